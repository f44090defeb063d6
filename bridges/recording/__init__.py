"""What was heard on RMF's graph and done by a daemon, as it is kept, read again and understood."""

"""What was heard on RMF's graph and what a daemon did: stored, read again and understood."""

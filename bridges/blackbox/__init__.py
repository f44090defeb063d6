"""What a daemon heard, decided and sent: kept in a ring, and written to files by the recorder."""

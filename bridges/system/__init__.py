"""Access to the machine on which a daemon runs: its log, its folders and files, and its terminal."""

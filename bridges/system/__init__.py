"""The machine of a daemon: its log, its folders and files, and its terminal."""

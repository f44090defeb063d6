"""The machine that a daemon runs on: its log, its folders and files, its terminal."""

"""Files that somebody adds: they are put into the folders of a copy, and nothing there is edited."""

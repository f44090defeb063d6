"""What somebody adds: the files below are put into the rooms of a copy, and nothing there is edited."""

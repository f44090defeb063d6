"""Recordings of a daemon's messages, events and decisions. Each daemon keeps its last minutes in a
ring, which is a file in memory. The recorder reads the rings and writes recordings to the disk."""

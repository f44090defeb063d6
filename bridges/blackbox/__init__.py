"""Recordings of a daemon's messages, events and decisions: the rings in memory, and the recorder's
files."""

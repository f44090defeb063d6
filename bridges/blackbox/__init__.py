"""Recordings of a daemon's messages, events and decisions. A ring in memory keeps the last minutes, and
the recorder writes files from the rings."""

"""Recordings of a daemon's messages, events and decisions: rings, and the recorder's files."""

"""Record a daemon's messages, events and decisions: a ring keeps them, the recorder writes files."""

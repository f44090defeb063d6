"""Read recordings of every kind, and replay their decisions."""

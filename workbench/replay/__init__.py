"""Read recordings of every format, and replay the recorded decisions."""

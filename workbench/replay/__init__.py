"""Read recordings of every format, and replay the decisions in them."""

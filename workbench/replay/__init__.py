"""Read recordings of every format, and replay the daemons' recorded decisions."""

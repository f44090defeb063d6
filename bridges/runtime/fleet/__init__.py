"""A fleet in service. RMF's adapter is on one side, and the robots' buses are on the other side."""

"""Benchmarks that compare the daemons' cost with the cost of a bare transport node in the same run."""

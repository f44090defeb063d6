"""Benchmarks: the daemons' cost divided by a bare transport node's cost in the same run."""

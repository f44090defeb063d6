"""Benchmarks: the daemons' cost as a ratio to a bare transport node's cost, in the same run."""

"""Benchmarks: the daemons' cost compared with a bare transport node's, as ratios in one run."""

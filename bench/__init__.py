"""Benchmarks: what the daemons cost beside a bare transport node, as ratios in one run."""

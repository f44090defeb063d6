"""Benchmarks. They divide the daemons' cost by the cost of a bare transport node in the same run."""

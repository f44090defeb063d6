"""Metrics for Prometheus about RMF's graph and about the daemons on this machine."""

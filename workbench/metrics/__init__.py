"""Metrics for Prometheus: of RMF's graph, and of the daemons on this machine."""

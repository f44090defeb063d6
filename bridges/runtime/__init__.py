"""Runs one YAML: the daemon, its loops, and the devices and subjects that they serve."""

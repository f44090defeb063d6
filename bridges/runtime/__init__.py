"""Serves one YAML: the daemon, its loops, and the devices and subjects on these loops."""

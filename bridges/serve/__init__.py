"""A YAML in service: the daemon, its loops, and the devices and subjects that they serve."""

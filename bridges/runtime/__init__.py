"""The daemon that serves the devices or subjects of one YAML. Each bus, or each kind without a bus, has
a loop in its own thread."""

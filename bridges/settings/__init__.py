"""Reads and validates a device YAML. It reports all problems at once, each with its line and column."""

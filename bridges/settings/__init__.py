"""Reads and validates a device YAML: all problems at once, each with its line and column."""

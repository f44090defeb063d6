"""A device YAML, read and judged: every problem at once, each at its line and column."""

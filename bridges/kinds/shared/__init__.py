"""Shared by all decision cores: decisions, debounce, kinds, and the fields of a device YAML."""

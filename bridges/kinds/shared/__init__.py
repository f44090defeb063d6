"""Common parts of all kinds: decisions, debounce, the records of kinds, the fields of a YAML."""

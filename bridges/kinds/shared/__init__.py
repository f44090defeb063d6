"""Common parts of all kinds: decisions, debounce, the structs that describe a kind, the fields of a
YAML."""

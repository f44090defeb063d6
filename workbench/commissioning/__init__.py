"""A new bridge at its controller: its first YAML, its machine examined, each wire tried."""

"""The black box: what it records, and how recordings are read."""

"""Reads YAML text into structs. It reports every problem at once, each with its line and column."""

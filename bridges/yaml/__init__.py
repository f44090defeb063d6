"""Reads YAML text into structs: every problem at once, each with its line and column."""

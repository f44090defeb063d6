"""Drivers for wireless chargers: a file for each protocol."""

"""Drivers for wireless chargers. Each protocol has a file."""

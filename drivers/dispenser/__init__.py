"""Drivers of dispensers, which serve ingestors too."""

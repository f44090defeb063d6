"""Drivers of dispensers, which also serve ingestors."""

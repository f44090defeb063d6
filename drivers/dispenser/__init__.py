"""Drivers for dispensers. The same drivers serve ingestors."""

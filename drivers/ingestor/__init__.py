"""Drivers of ingestors, which are those of dispensers."""

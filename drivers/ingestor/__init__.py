"""Drivers of ingestors. They are the drivers of dispensers."""

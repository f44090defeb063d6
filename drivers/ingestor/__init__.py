"""Drivers of ingestors: those of dispensers."""

"""Drivers of ingestors. These drivers are the same as the drivers of dispensers."""

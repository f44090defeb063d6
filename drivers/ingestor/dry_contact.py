"""An ingestor with a dispenser's wiring: see `drivers/dispenser/dry_contact.py`."""

from drivers.dispenser import dry_contact

DRIVER = dry_contact.DRIVER

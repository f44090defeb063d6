"""An ingestor with a dispenser's wiring: see `drivers/dispenser/register.py`."""

from drivers.dispenser import register

DRIVER = register.DRIVER

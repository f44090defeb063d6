"""An ingestor with a dispenser's wiring: see `drivers/dispenser/http.py`."""

from drivers.dispenser import http

DRIVER = http.DRIVER

"""Fake hardware for the far side of each bus, where the real devices would be. A plant simulates the
physics of one device in virtual time. Plants move, stick, report false states, and fail.

`bridges/` and `drivers/` never import this package. Only `rmf-bridge run --simulate` and the tests
import it. The other files put a plant behind a real gpiozero mock pin, a real Modbus server or a real
HTTP server.
"""

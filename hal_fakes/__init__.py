"""Fake hardware at the far side of the wire. Its plants move, stick, report false states, and fail.

`bridges/` and `drivers/` never import this package. Only `rmf-bridge run --simulate` and the tests
import it. A plant is the physics of a device, in virtual time. The other files put a plant behind a
real gpiozero mock pin, a real Modbus server or a real HTTP server.
"""

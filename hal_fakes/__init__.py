"""Fake hardware at the far side of the wire: plants that move, stick, lie and die.

`bridges/` and `drivers/` never import this package; only `rmf-bridge run --simulate` and the tests do.
A plant is physics in virtual time. The other files put a plant behind a real gpiozero mock pin, a real
Modbus server or a real HTTP server.
"""

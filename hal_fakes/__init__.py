"""Fake hardware at the far side of the wire: plants that move, stick, lie and die.

Never imported by `bridges/` or `drivers/` (only `rmf-bridge run --simulate` and the tests import it). A
plant is physics in virtual time; the other files put it behind a real gpiozero mock pin, a real Modbus
server or a real HTTP server.
"""

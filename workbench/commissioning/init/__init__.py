"""What `rmf-bridge init` writes: a commented YAML made from a few answers. Pure: answers in, text out.

`lift.py`, `door.py` and `charger.py` write the section of a device, `points.py` gives each signal a
pin or an address of its own.
"""

from typing import Final

from workbench.commissioning.init import charger, door, lift
from workbench.commissioning.init.answers import Answers, Impossible
from workbench.commissioning.init.points import points_for
from workbench.commissioning.init.scalar import quoted

DEVICES: Final = {"lift": lift.section, "door": door.section, "charger": charger.section}
DRIVERS: Final = {"http": "http", "can": "canopen"}
"""The driver for a wiring; `dry_contact` for any other."""
WIRINGS: Final = {
    "lift": ("gpio", "modbus", "rs485"),
    "door": ("modbus", "rs485", "gpio", "http"),
    "charger": ("http", "can", "modbus", "rs485", "gpio"),
}
BUSES: Final = {
    "gpio": "  header: {{type: gpio}}",
    "modbus": "  module: {{type: modbus, tcp: {{host: {address}, port: 502}}}}",
    "rs485": "  line:\n    type: modbus\n"
    "    serial: {{port: {address}, baudrate: 19200, parity: none, stopbits: 1}}",
    "http": "  web: {{type: http, api_base: {address}}}",
    "can": "  can: {{type: can, socketcan: {address}}}",
}
ADDRESSES: Final = {
    "modbus": "192.168.1.50",
    "rs485": "/dev/ttyUSB0",
    "http": "192.168.1.60",
    "can": "can0",
}
"""The address that is offered for a wiring; a GPIO header has none."""


def draft(answers: Answers) -> str:
    """The whole file. Raises Impossible if these answers do not go together."""
    if answers.wiring not in WIRINGS[answers.kind]:
        raise Impossible(
            f"a {answers.kind} is not wired by {answers.wiring}: {', '.join(WIRINGS[answers.kind])}"
        )
    address = answers.address or ADDRESSES.get(answers.wiring, "")
    lines = [
        f"# {answers.name}: compare every point with the wires, then `rmf-bridge check` this file.",
        "# docs/configuration.md lists every key, docs/wiring.md says how wires fail.",
        f"kind: {answers.kind}",
        f"driver: {DRIVERS.get(answers.wiring, 'dry_contact')}",
        "",
        "rmf:",
        "  transport: auto        # rclpy where ROS 2 is installed, else DDS or zenoh without ROS",
        f"  domain_id: {answers.domain_id}           # RMF's ROS_DOMAIN_ID",
        "",
        "buses:",
        BUSES[answers.wiring].format(address=quoted(address)),
        "",
        f"{answers.kind}s:",
        f"  {quoted(answers.name)}:",
        *DEVICES[answers.kind](answers, points_for(answers)),
    ]
    return "\n".join(lines) + "\n"

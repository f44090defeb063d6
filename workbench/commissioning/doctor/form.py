"""The form for tests on real hardware, which take an afternoon (docs/how-to/hardware.md).

`doctor` fills in the cells for the machine and the findings. A person fills in the other cells.
"""

import platform
import time
from collections.abc import Iterable
from hashlib import sha256
from typing import Final

import msgspec

from bridges import __version__
from bridges.messages.words import printable
from bridges.settings.load import Config
from workbench.commissioning.doctor.finding import Finding
from workbench.commissioning.doctor.machine import Machine

ALL: Final = frozenset({"gpio", "modbus", "http", "can"})


class FormStep(msgspec.Struct, frozen=True):
    """One step of docs/how-to/hardware.md. `buses` lists the buses that need the step. `seen` is the
    result that a person should see."""

    number: str
    buses: frozenset[str]
    seen: str


STEPS: Final = (
    FormStep(
        "H1", frozenset({"gpio"}), "no relay moves from power-on until the daemon has claimed it"
    ),
    FormStep(
        "H2",
        ALL,
        "off after `kill -9` with the output on; seconds until off; volts on the pin afterwards",
    ),
    FormStep("H3", ALL, "off after SIGSTOP with the output on; seconds until off"),
    FormStep(
        "H4",
        ALL,
        "the Pi's power is cut with the output on: off at once, or seconds from the power's return"
        " until off",
    ),
    FormStep(
        "H5",
        frozenset({"gpio"}),
        "the supply falls to 4.0 V in steps: no relay comes on; volts at which the Pi resets",
    ),
    FormStep(
        "H6",
        ALL,
        "the card is pulled with the output on, then `kill -9`: off; seconds until off",
    ),
    FormStep(
        "H7",
        frozenset({"modbus"}),
        "milliseconds from the request's end until A-B is free, and until the reply; no reply lost",
    ),
    FormStep(
        "H8",
        frozenset({"modbus", "can"}),
        "the USB adapter is pulled: a fault; it is put back: the device is served again",
    ),
    FormStep(
        "H9",
        frozenset({"modbus"}),
        "the line is cut with the output on: seconds until the module switches it off",
    ),
    FormStep(
        "H10",
        frozenset({"can"}),
        "CAN_H and CAN_L are shorted for 1 s: a fault, then served again; no charge",
    ),
    FormStep("H11", ALL, "24 h of service: faults in the log, hottest °C, bits of get_throttled"),
)


def form(config: Config, found: Iterable[Finding], machine: Machine) -> str:
    """Return the form as Markdown, with the steps for this file's buses."""
    buses = set(config.bus_types.values())
    model = machine.text("/proc/device-tree/model") or platform.machine()
    lines = [
        f"# {config.path.name} on {model}",
        f"{time.strftime('%Y-%m-%d %H:%M')}, rmf-bridges {__version__}, kernel {platform.release()},"
        f" Python {platform.python_version()}, buses: {', '.join(sorted(buses)) or 'none'}",
        "",
        f"YAML: sha256 {sha256(config.text).hexdigest()}",
        "",
        "| subject | | found by `doctor` |",
        "|---|---|---|",
        *(f"| {_cell(one.subject)} | {one.level} | {_cell(one.found)} |" for one in found),
        "",
        "Steps of docs/how-to/hardware.md, each three times. An empty cell: not measured.",
        "",
        "| step | must be seen | seen | figures of three times | with which parts | who, when |",
        "|---|---|---|---|---|---|",
        *(f"| {one.number} | {one.seen} | | | | |" for one in STEPS if one.buses & buses),
    ]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return printable(text).replace("|", "\\|")

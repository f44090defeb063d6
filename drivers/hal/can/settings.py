"""The settings of a CAN bus in a device YAML (`type: can`)."""

import os
from typing import Annotated, Final

import msgspec

from bridges.kinds.shared.fields import Name, Period, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal import BusSettings, Needs, Where, serial_port

BITRATES: Final = (
    10_000,
    20_000,
    50_000,
    83_300,
    100_000,
    125_000,
    250_000,
    500_000,
    750_000,
    1_000_000,
)

Interface = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[A-Za-z0-9._-]{1,15}$", extra={"pattern": "an interface's name, such as can0"}
    ),
]
Timeout = Annotated[float, msgspec.Meta(ge=0.05, le=5, extra={"unit": "s"})]


class Slcan(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A serial or USB adapter that speaks slcan (LAWICEL)."""

    port: Annotated[Name, tells("the adapter's path; a path in /dev/serial/by-id never changes.")]
    bitrate: Annotated[
        int,
        msgspec.Meta(ge=10_000, le=1_000_000, extra={"unit": "bit/s"}),
        tells("the CAN bus's bitrate."),
    ]
    baudrate: Annotated[
        int,
        msgspec.Meta(ge=9600, le=3_000_000, extra={"unit": "Bd"}),
        tells("the rate of the serial port; USB adapters accept any rate."),
    ] = 115_200


class CanSettings(BusSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="can"):
    """One CAN bus. The YAML gives either `socketcan` or `slcan`."""

    socketcan: Annotated[
        Interface | None,
        tells(
            """the kernel's interface (`can0`). `ip link` sets its bitrate. Most adapters and the
        CAN boards of a Raspberry Pi have such an interface."""
        ),
    ] = None
    slcan: Annotated[Slcan | None, tells("an adapter on a serial port.")] = None
    timeout_s: Annotated[
        Timeout, tells("the time limit for a reply, and for handing a frame to the adapter.")
    ] = 0.2
    scan_s: Annotated[
        Period, tells("the period at which the daemon reads the devices and sends frames.")
    ] = 0.2

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        if self.socketcan is None and self.slcan is None:
            yield (), "needs an interface: write socketcan: can0, or slcan: {port: …, bitrate: …}"
        elif self.socketcan and self.slcan:
            yield (
                ("slcan",),
                "a bus has only one of socketcan and slcan: define a second bus",
            )
        if self.slcan and self.slcan.bitrate not in BITRATES:
            known = ", ".join(map(str, BITRATES))
            yield ("slcan", "bitrate"), f"slcan adapters know {known}"


def warnings(settings: CanSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    if settings.slcan and not settings.slcan.port.startswith("/dev/serial/by-"):
        port = settings.slcan.port
        text = f"{port} may name another adapter after a reboot: use a path of /dev/serial/by-id"
        yield ("slcan", "port"), text


def where(settings: CanSettings) -> Where:
    """Return the interface or port that the bus uses. Several programs can use a kernel's interface at
    the same time, but only one can use an adapter's port."""
    if settings.slcan:
        return Where(os.path.normpath(settings.slcan.port), local=True, clients="one")
    return Where(str(settings.socketcan), local=True)


def needs(settings: CanSettings) -> Needs:
    """Return the permissions that the daemon needs: CAN sockets for a kernel's interface, or access to
    the adapter's port."""
    return serial_port.needs(settings.slcan.port) if settings.slcan else Needs(family="AF_CAN")


def describe(settings: CanSettings) -> str:
    """Describe for `check` where the bus is."""
    if settings.slcan:
        return f"{settings.slcan.port}, {settings.slcan.bitrate // 1000} kbit/s"
    return f"{settings.socketcan}, at the bitrate that `ip link` gave it"

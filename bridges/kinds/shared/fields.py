"""The building blocks of every device YAML: numbers with units, names, common structs.

`bridges/settings/load.py` reads a file into these types. The kinds and drivers derive their own structs
from them. A struct may have a method `problems() -> Remarks` that checks several fields together. The
method yields pairs: a path below the struct, and a text with the remedy. The loader calls `problems`
when every field is present and has the right type. It does so even if `problems` of a nested struct has
yielded something.
"""

from collections.abc import Iterable
from typing import Annotated

import msgspec
from msgspec import Meta

Name = Annotated[
    str,
    Meta(
        min_length=1,
        max_length=128,
        pattern=r"^[^\x00-\x20\x7f-\x9f]([^\x00-\x1f\x7f-\x9f]*[^\x00-\x20\x7f-\x9f])?$(?!\n)",
        extra={"pattern": "text without control characters, and without spaces at its ends"},
    ),
]
"""A name in RMF, which may be any text. Put a text in quotes if YAML would read it as a number or
another type."""
AbsolutePath = Annotated[
    str,
    Meta(
        max_length=4096,
        pattern=r"^/[^\x00-\x1f\x7f]*$(?!\n)",
        extra={"pattern": "a file's whole path (/opt/ros/jazzy/setup.bash)"},
    ),
]
"""An absolute path of a file."""
Seconds = Annotated[float, Meta(ge=0, le=86400, extra={"unit": "s"})]
"""A duration that may be zero."""
Timeout = Annotated[float, Meta(ge=1, le=86400, extra={"unit": "s"})]
"""A time limit for an attempt. Zero is not allowed, because then every attempt would fail at once."""
Period = Annotated[float, Meta(ge=0.01, le=60, extra={"unit": "s"})]
"""A repetition period."""
Brief = Annotated[float, Meta(ge=0, le=60, extra={"unit": "s"})]
"""A short duration that may be zero: a pause, a pulse, a bounce."""
QuietStart = Annotated[float, Meta(ge=3, le=60, extra={"unit": "s"})]
"""The time after the start in which a node without hardware only listens."""
Patience = Annotated[
    float,
    Meta(
        ge=3,
        le=86400,
        extra={
            "unit": "s",
            "least": "RMF repeats its messages once a second, and two repeats may be lost",
        },
    ),
]
"""The time for which the daemon tolerates a silence or a state before it acts."""


def tells(text: str) -> Meta:
    """Describe a key of the YAML. The schema, the reference and an editor show this text. Line breaks
    count as spaces."""
    return Meta(description=" ".join(text.split()))


class DeviceSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings that every device has, whatever its driver."""

    bus: Annotated[
        Name | None, tells("the device's bus; not needed if the file has only one bus.")
    ] = None
    driver: Annotated[
        Name | None, tells("this device's driver; when absent, the `driver` of the file.")
    ] = None
    accept_unsafe: Annotated[
        dict[Name, Name],
        tells(
            "signal -> the reason why the site accepts its unsafe wiring. `check` prints the reason."
        ),
    ] = {}

    def off_after(self) -> tuple[float, tuple[str, ...]] | None:
        """Return a time (s) and the path of the setting that gives it. If the device gets no new
        command for this time, it switches its outputs off by itself. Return None if its outputs stay
        on."""
        return None

    def stale_after(self) -> float | None:
        """Return the time (s) without a reading after which the device is out of service. Return None
        for a device without such a limit."""
        return None

    def awaited(self) -> Iterable[tuple[str, str, str]]:
        """Yield (signal, limit, other signal). The signal, or one of this group, must come within the
        time of this key of `limits`. The time runs from a command; or, if the other signal is not "",
        from the end of that signal."""
        return ()


class GraphSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of every kind without hardware."""

    quiet_start_s: Annotated[
        QuietStart,
        tells(
            "how long the node only listens after its start, so that a restart interrupts nothing."
        ),
    ] = 3.0


def quiet_s(settings: GraphSettings) -> float:
    """Return the time (s) for which the node only listens after its start."""
    return settings.quiet_start_s

"""What the sections of every device YAML are made of: numbers with units, names, common structs.

`bridges/settings/load.py` reads a file into these; the kinds and drivers derive their own from them.
A struct may have `problems() -> Iterable[tuple[tuple[str, ...], str]]`: what its fields cannot say
one by one, as (path below the struct, text with the fix). It is asked when each field is there and
of the right sort, even if a struct below has problems of its own.
"""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Seconds = Annotated[float, Meta(ge=0, le=86400, extra={"unit": "s"})]
"""A duration that may be zero."""
Timeout = Annotated[float, Meta(ge=1, le=86400, extra={"unit": "s"})]
"""After how long something is given up: with zero it would never be tried."""
Period = Annotated[float, Meta(ge=0.01, le=60, extra={"unit": "s"})]
"""A repetition period."""
QuietStart = Annotated[float, Meta(ge=3, le=60, extra={"unit": "s"})]
"""How long a node without hardware only listens at first."""
Patience = Annotated[float, Meta(ge=3, le=86400, extra={"unit": "s"})]
"""How long somebody may be silent, or something may last, before it matters."""
Name = Annotated[
    str,
    Meta(
        min_length=1,
        max_length=128,
        pattern=r"^[^\x00-\x20\x7f-\x9f]([^\x00-\x1f\x7f-\x9f]*[^\x00-\x20\x7f-\x9f])?$(?!\n)",
        extra={"pattern": "text without control characters, or spaces at its ends,"},
    ),
]
"""A name that RMF uses: any text, quoted in YAML where YAML would read something else."""
AbsolutePath = Annotated[
    str,
    Meta(
        max_length=4096,
        pattern=r"^/[^\x00-\x1f\x7f]*$(?!\n)",
        extra={"pattern": "a file's whole path (/opt/ros/jazzy/setup.bash)"},
    ),
]
"""A file by its path from the root."""


class Rmf(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the daemon reaches Open-RMF.

    `transport`: `ros2` (rclpy), `dds` (without ROS), or `auto`: rclpy where it imports, else dds.
    `domain_id`: the DDS domain; ROS_DOMAIN_ID, or 0, when absent.
    `network`: `localhost` keeps all traffic on the loopback interface.
    `ros_setup`: ROS's setup file, sourced before the daemon starts (not for `dds`): a service has no
    shell that has done so. Where `auto` does not find it, that is logged.
    `diagnostics`: each second, say on ROS's `/diagnostics` how the daemon and its devices are.
    `topics`: RMF's topic name -> the name that the site uses.
    """

    transport: Literal["auto", "ros2", "dds"] = "auto"
    domain_id: Annotated[int, Meta(ge=0, le=232)] | None = None
    network: Literal["subnet", "localhost"] = "subnet"
    ros_setup: AbsolutePath | None = None
    diagnostics: bool = True
    topics: dict[Name, Name] = msgspec.field(default_factory=dict)


class DeviceSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every lift, door and charger has, whatever its driver.

    `bus`: the name of the bus that it stands on; not needed where the file has one.
    `accept_unsafe`: signal -> why its unsafe wiring is accepted; `check` prints it.
    """

    bus: Name | None = None
    accept_unsafe: dict[Name, Name] = msgspec.field(default_factory=dict)

    def stale_after(self) -> float | None:
        """After how long (s) without a reading it is out of service; None where that is not a time."""
        return None


class GraphSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every kind without hardware has.

    `quiet_start_s`: how long it only listens at first.
    """

    quiet_start_s: QuietStart = 3.0


def quiet_s(settings: GraphSettings) -> float:
    """How long it only listens before it sends its first message (s)."""
    return settings.quiet_start_s

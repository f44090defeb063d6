"""What the sections of every device YAML are made of: numbers with units, names, common structs.

`bridges/settings/load.py` reads a file into these; the kinds and drivers derive their own from them.
A struct may have `problems() -> Iterable[tuple[tuple[str, ...], str]]`: what its fields cannot say
one by one, as (path below the struct, text with the fix). It is asked when each field is there and
of the right sort, even if a struct below has problems of its own.
"""

from collections.abc import Iterable
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
        extra={"pattern": "text without control characters, or spaces at its ends"},
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
Endpoint = Annotated[
    str,
    Meta(
        max_length=256,
        pattern=r"^(tcp|tls|quic)/(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9_.-]+):[0-9]{1,5}$(?!\n)",
        extra={"pattern": "protocol/host:port (tcp/192.168.1.5:7447, tls/rmf.local:7447)"},
    ),
]
"""Where a zenoh program listens or is reached."""


class ZenohTls(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Encryption of `tls/…` and `quic/…` endpoints, from PEM files.

    `ca`: who has signed the router's certificate; the public authorities when absent.
    `certificate`, `private_key`: our own, where the router asks for one (mutual TLS). The key's file
    is readable by the daemon's user alone.
    """

    ca: AbsolutePath | None = None
    certificate: AbsolutePath | None = None
    private_key: AbsolutePath | None = None

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """A certificate and its key go together."""
        if (self.certificate is None) != (self.private_key is None):
            yield (), "certificate and private_key go together: give both, or none"


class Zenoh(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How transport `zenoh` reaches the others.

    `keys`: `rmw_zenoh` for sites whose RMF runs on rmw_zenoh, `ros2dds` for sites with a
    zenoh-bridge-ros2dds beside RMF; the two do not understand each other.
    `connect`: the router (or the bridge); of several, one is used and the others stand by.
    `mode`: `peer` also speaks to other nodes directly, `client` to a router alone. `auto` is `peer`
    with one router, if it is on this machine or `listen` is open to others; else `client`.
    `listen`: where other nodes reach a peer; this machine alone when absent.
    `tls`: certificates, for `tls/…` and `quic/…`.
    `user`: the name that the routers know us by.
    `password_file`: a file that holds its password, readable by the daemon's user alone.
    """

    keys: Literal["rmw_zenoh", "ros2dds"] = "rmw_zenoh"
    connect: Annotated[tuple[Endpoint, ...], Meta(min_length=1)] = ("tcp/localhost:7447",)
    mode: Literal["auto", "peer", "client"] = "auto"
    listen: tuple[Endpoint, ...] = ("tcp/127.0.0.1:0",)
    tls: ZenohTls | None = None
    user: Name | None = None
    password_file: AbsolutePath | None = None

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """What cannot go together."""
        if (self.user is None) != (self.password_file is None):
            yield (), "user and password_file go together: give both, or none"
        if self.tls and not any(map(_is_encrypted, (*self.connect, *self.listen))):
            yield ("tls",), "no endpoint is encrypted: write connect: [tls/host:port]"
        if any(map(_is_encrypted, self.listen)) and not (self.tls and self.tls.certificate):
            yield ("listen",), "who listens with TLS needs tls: {certificate: …, private_key: …}"


def _is_encrypted(endpoint: str) -> bool:
    return endpoint.startswith(("tls/", "quic/"))


class Rmf(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the daemon reaches Open-RMF.

    `transport`: `ros2` (rclpy), `dds` or `zenoh` (both without ROS), or `auto`: rclpy where it
    imports, else dds where cyclonedds imports, else zenoh.
    `domain_id`: the ROS domain; ROS_DOMAIN_ID, or 0, when absent.
    `network`: `localhost` keeps all traffic on the loopback interface.
    `ros_setup`: ROS's setup file, sourced before the daemon starts (not for `dds`, `zenoh`): a
    service has no shell that has done so. Where `auto` does not find it, that is logged.
    `diagnostics`: each second, say on ROS's `/diagnostics` how the daemon and its devices are.
    `topics`: RMF's topic name -> the name that the site uses.
    `zenoh`: routers, keys and credentials of transport `zenoh`.
    """

    transport: Literal["auto", "ros2", "dds", "zenoh"] = "auto"
    domain_id: Annotated[int, Meta(ge=0, le=232)] | None = None
    network: Literal["subnet", "localhost"] = "subnet"
    ros_setup: AbsolutePath | None = None
    diagnostics: bool = True
    topics: dict[Name, Name] = msgspec.field(default_factory=dict)
    zenoh: Zenoh | None = None

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """What would have no effect."""
        if self.zenoh and self.transport in ("ros2", "dds"):
            yield ("zenoh",), f"transport {self.transport} does not read it: write transport: zenoh"


class DeviceSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every lift, door and charger has, whatever its driver.

    `bus`: the name of the bus that it stands on; not needed where the file has one.
    `driver`: where it is reached otherwise than the file's others; the file's `driver` when absent.
    `accept_unsafe`: signal -> why its unsafe wiring is accepted; `check` prints it.
    """

    bus: Name | None = None
    driver: Name | None = None
    accept_unsafe: dict[Name, Name] = msgspec.field(default_factory=dict)

    def off_after(self) -> tuple[float, tuple[str, ...]] | None:
        """After how long (s) without a command what it drives is off by itself, and the setting."""
        return None

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

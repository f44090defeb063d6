"""The `rmf:` section of a YAML: which transport reaches Open-RMF, and how."""

import argparse
from collections.abc import Iterable
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

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

    `ca`: the authority that has signed the router's certificate; the public ones when absent.
    `certificate`, `private_key`: the daemon's own, if the router asks for one (mutual TLS). Only the
    daemon's user may read the key's file.
    """

    ca: AbsolutePath | None = None
    certificate: AbsolutePath | None = None
    private_key: AbsolutePath | None = None

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """A certificate and its key go together."""
        if (self.certificate is None) != (self.private_key is None):
            yield (), "certificate and private_key go together: give both, or none"


class Zenoh(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How transport `zenoh` reaches the other nodes.

    `keys`: `rmw_zenoh` for sites whose RMF runs on rmw_zenoh, `ros2dds` for sites with a
    zenoh-bridge-ros2dds beside RMF; the two do not understand each other.
    `connect`: the router (or the bridge). If there are several, one is used and the others stand by.
    `mode`: `peer` also speaks to other nodes directly, `client` to a router alone. `auto` is `peer`
    with one router, if it is on this machine or `listen` is open to others; else `client`.
    `listen`: where other nodes reach this one as a peer; only from this machine when absent.
    `tls`: certificates, for `tls/…` and `quic/…`.
    `user`: the daemon's user name at the routers.
    `password_file`: a file with its password. Only the daemon's user may read it.
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

    `transport`: `ros2` (rclpy), `dds` or `zenoh` (both without ROS). `auto` takes ros2 if rclpy can be
    imported, else dds if cyclonedds can be, else zenoh.
    `domain_id`: the ROS domain; ROS_DOMAIN_ID, or 0, when absent.
    `network`: `localhost` keeps all traffic on the loopback interface.
    `ros_setup`: ROS's setup file, sourced before the daemon starts, as a service has no shell that
    has done so. Not for `dds` and `zenoh`. If `auto` does not find the file, it logs that.
    `diagnostics`: publish the health of the daemon and its devices each second on `/diagnostics`.
    `topics`: RMF's topic name -> the name that the site uses.
    `zenoh`: routers, keys and credentials of transport `zenoh`.
    `release`: of which release RMF's messages are: `jazzy` (Humble, Iron and Jazzy) or `kilted`
    (Kilted, Lyrical and newer). `auto` follows the fleet adapters on the graph, and is `jazzy` without
    one. Transport `ros2` takes what is installed.
    """

    transport: Literal["auto", "ros2", "dds", "zenoh"] = "auto"
    domain_id: Annotated[int, Meta(ge=0, le=232)] | None = None
    network: Literal["subnet", "localhost"] = "subnet"
    ros_setup: AbsolutePath | None = None
    diagnostics: bool = True
    topics: dict[Name, Name] = msgspec.field(default_factory=dict)
    zenoh: Zenoh | None = None
    release: Literal["auto", "jazzy", "kilted"] = "auto"

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """What would have no effect."""
        if self.release != "auto" and self.transport == "ros2":
            yield ("release",), "transport ros2 takes what is installed: leave it out"
        if self.zenoh and self.transport in ("ros2", "dds"):
            yield ("zenoh",), f"transport {self.transport} does not read it: write transport: zenoh"


TRANSPORTS = ("auto", "ros2", "dds", "zenoh")


def overridden(rmf: Rmf, args: argparse.Namespace) -> Rmf:
    """A YAML's `rmf:` section, changed by the options of the command line."""
    if args.domain_id is not None:
        rmf = msgspec.structs.replace(rmf, domain_id=args.domain_id)
    if args.transport is not None:
        rmf = msgspec.structs.replace(rmf, transport=args.transport)
    return rmf

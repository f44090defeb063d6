"""The `rmf:` section of a YAML: the transport to Open-RMF, and the settings of that transport."""

import argparse
import re
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from bridges.kinds.shared.fields import AbsolutePath, Name, tells
from bridges.kinds.shared.remarks import Remarks

Endpoint = Annotated[
    str,
    Meta(
        max_length=256,
        pattern=r"^(tcp|tls|quic)/(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9_.-]+):[0-9]{1,5}$(?!\n)",
        extra={"pattern": "protocol/host:port (tcp/192.168.1.5:7447, tls/rmf.local:7447)"},
    ),
]
"""The address of a zenoh router or peer."""


class ZenohTls(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The encryption of `tls/…` and `quic/…` endpoints. Certificates and keys are PEM files."""

    ca: Annotated[
        AbsolutePath | None,
        tells("""a file with the certificate of the authority that signed the router's certificate.
        When absent, the public authorities are trusted."""),
    ] = None
    certificate: Annotated[
        AbsolutePath | None,
        tells("the daemon's certificate, if the router asks for one (mutual TLS)."),
    ] = None
    private_key: Annotated[
        AbsolutePath | None,
        tells("a file with the certificate's key. Only the daemon's user may read the file."),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem if only one of certificate and key is given."""
        if (self.certificate is None) != (self.private_key is None):
            yield (), "certificate and private_key go together: give both, or none"


class Zenoh(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Connection of transport `zenoh` to the other nodes."""

    keys: Annotated[
        Literal["rmw_zenoh", "ros2dds"],
        tells("""`rmw_zenoh` for sites whose RMF runs on rmw_zenoh, `ros2dds` for sites with a
        zenoh-bridge-ros2dds beside RMF. These two dialects do not understand each other."""),
    ] = "rmw_zenoh"
    connect: Annotated[
        tuple[Endpoint, ...],
        Meta(min_length=1),
        tells("""the router (or the bridge). If several are listed, the daemon uses one, and the others
        stand by."""),
    ] = ("tcp/localhost:7447",)
    mode: Annotated[
        Literal["auto", "peer", "client"],
        tells("""`client`: the node speaks only to a router. `peer`: the node also speaks to other
        nodes directly. `auto` is `peer` under two conditions: there is only one router, and either
        this router is on this machine or `listen` is open to other machines. Otherwise `auto` is
        `client`."""),
    ] = "auto"
    listen: Annotated[
        tuple[Endpoint, ...],
        tells("""the addresses at which other nodes reach this node as a peer. When absent, only nodes
        of this machine reach this node."""),
    ] = ("tcp/127.0.0.1:0",)
    tls: Annotated[ZenohTls | None, tells("certificates, for `tls/…` and `quic/…`.")] = None
    user: Annotated[Name | None, tells("the daemon's user name at the routers.")] = None
    password_file: Annotated[
        AbsolutePath | None,
        tells("a file with the password of `user`. Only the daemon's user may read the file."),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem for each invalid combination of keys."""
        if (self.user is None) != (self.password_file is None):
            yield (), "user and password_file go together: give both, or none"
        if self.tls and not any(map(_is_encrypted, (*self.connect, *self.listen))):
            yield ("tls",), "no endpoint is encrypted: write connect: [tls/host:port]"
        if any(map(_is_encrypted, self.listen)) and not (self.tls and self.tls.certificate):
            yield ("listen",), "listening with TLS needs tls: {certificate: …, private_key: …}"


def _is_encrypted(endpoint: str) -> bool:
    return endpoint.startswith(("tls/", "quic/"))


class Rmf(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The daemon's connection to Open-RMF."""

    transport: Annotated[
        Literal["auto", "ros2", "dds", "zenoh"],
        tells("""`ros2` (rclpy), `dds` or `zenoh` (both without ROS). `auto` takes ros2 if rclpy can
        be imported, else dds if cyclonedds can be imported, else zenoh."""),
    ] = "auto"
    domain_id: Annotated[
        Annotated[int, Meta(ge=0, le=232)] | None,
        tells("""the ROS domain. When absent, it is ROS_DOMAIN_ID of the environment; without that
        variable it is 0."""),
    ] = None
    network: Annotated[
        Literal["subnet", "localhost"],
        tells("`localhost` keeps all traffic on the loopback interface."),
    ] = "subnet"
    ros_setup: Annotated[
        AbsolutePath | None,
        tells("""ROS's setup file. The daemon sources the file before it starts, because a service
        has no shell that sources it. With `dds` and `zenoh` the key has no effect. With `auto`, a
        missing file is only logged."""),
    ] = None
    diagnostics: Annotated[
        bool,
        tells("publish the health of the daemon and its devices each second on `/diagnostics`."),
    ] = True
    topics: Annotated[dict[Name, Name], tells("RMF's name of a topic -> the site's name.")] = {}
    zenoh: Annotated[
        Zenoh | None, tells("the settings of transport `zenoh`: routers, keys, certificates.")
    ] = None
    release: Annotated[
        Literal["auto", "jazzy", "kilted"],
        tells("""the release of RMF's messages: `jazzy` (Humble, Iron and Jazzy) or `kilted`
        (Kilted, Lyrical and newer). `auto` follows the fleet adapters on the graph, and is `jazzy`
        without a fleet adapter. Transport `ros2` uses the installed message packages."""),
    ] = "auto"

    def problems(self) -> Remarks:
        """Yield a problem for each setting that has no effect."""
        if self.release != "auto" and self.transport == "ros2":
            yield (
                ("release",),
                "transport ros2 uses the installed message packages: leave the key out",
            )
        if self.zenoh and self.transport in ("ros2", "dds"):
            yield (
                ("zenoh",),
                f"transport {self.transport} does not read this section: write transport: zenoh",
            )


def warnings(rmf: Rmf) -> Remarks:
    """Yield a warning for each valid setting that is probably a mistake."""
    if rmf.domain_id is not None and 101 < rmf.domain_id < 215:
        text = "is in a range whose ports Linux gives to other programs: take 0 to 101"
        yield ("domain_id",), f"{rmf.domain_id} {text}"
    release = re.match(r"/opt/ros/([^/]+)/", rmf.ros_setup or "")
    if release and release[1] not in ROS_RELEASES:
        yield ("ros_setup",), f"{release[1]} is no release of ROS 2: {', '.join(ROS_RELEASES)}"
    elif rmf.ros_setup and Path("/opt/ros").is_dir() and not Path(rmf.ros_setup).is_file():
        text = "does not exist, but this machine has ROS: install that release, or correct the path"
        yield ("ros_setup",), f"{rmf.ros_setup} {text}"


ROS_RELEASES: Final = ("humble", "iron", "jazzy", "kilted", "lyrical", "rolling")
"""The ROS releases for which RMF's messages can be installed."""
TRANSPORTS = ("auto", "ros2", "dds", "zenoh")


def overridden(rmf: Rmf, args: argparse.Namespace) -> Rmf:
    """Return the YAML's `rmf:` section, changed by the command line's options."""
    if args.domain_id is not None:
        rmf = msgspec.structs.replace(rmf, domain_id=args.domain_id)
    if args.transport is not None:
        rmf = msgspec.structs.replace(rmf, transport=args.transport)
    return rmf

"""Two configurations of a zenoh session. The first is for the network: rmw_zenoh's configuration,
changed by the YAML's settings. The second keeps a node on this machine.

Source: ros2/rmw_zenoh, jazzy, DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5; zenoh's DEFAULT_CONFIG.json5.
"""

import re
from typing import Final

from bridges.kinds.shared.rmf_section import Zenoh, ZenohTls
from bridges.system import user_files
from bridges.transports.transport import TransportError

Configuration = dict[str, object]
"""A mapping from keys of zenoh's configuration to their JSON values."""

LOOPBACK_PORT: Final = 17400
"""The port on which the nodes of domain 0 on this machine find each other. Domain N uses this port
number plus N.

The port collides neither with routers, which use 7447, nor with the ports that Linux assigns by itself,
which begin at 32768.
"""
RETRY: Final = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}

COMMON: Final[Configuration] = {
    "scouting/multicast/enabled": False,
    "scouting/delay": 1,  # ms; there is nothing to wait for, because scouting is off
    # zenoh's own clock panics at times before 1970. After a panic zenoh neither sends nor hears
    # messages. Retained messages need no timestamps, because they are ordered by their numbers.
    "timestamping/enabled": False,
    # A subscription asks other nodes for retained messages, and new messages wait until they answer. So
    # this is the longest time (ms) for which a node that hangs can delay a fire alarm. rmw_zenoh would
    # wait for ever.
    "queries_default_timeout": 3000,
    "transport/shared_memory/enabled": False,
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "connect/retry": RETRY,
}
_LOCAL = re.compile(r"[a-z]+/(localhost|127\.[0-9.]+|\[::1\]):[0-9]+")


def is_local(endpoint: str) -> bool:
    """Return whether this endpoint is on the loopback interface of this machine."""
    return _LOCAL.fullmatch(endpoint) is not None


def on_loopback(domain_id: int) -> list[Configuration]:
    """Return configurations for a node that connects only to nodes of its domain on this machine, and
    to no router. The caller tries the configurations in order.

    The first node listens on the domain's port, and tells the later nodes of each other. A later node
    keeps trying to connect to that port. So it also finds a node that takes over the port later.
    """
    meeting = f"tcp/127.0.0.1:{LOOPBACK_PORT + domain_id}"
    common = COMMON | {
        "mode": "peer",
        "listen/exit_on_failure": True,
        "scouting/gossip/autoconnect": {"router": [], "peer": ["peer"]},
    }
    return [
        common | {"listen/endpoints": [meeting]},
        common | {"listen/endpoints": ["tcp/127.0.0.1:0"], "connect/endpoints": [meeting]},
    ]


def on_the_site(zenoh: Zenoh) -> Configuration:
    """Return the configuration for the YAML's settings. Raises TransportError for a missing file, and
    for a secret that other users can read."""
    wanted = COMMON | {"mode": mode(zenoh), "connect/endpoints": list(zenoh.connect)}
    if wanted["mode"] == "peer":
        wanted["listen/endpoints"] = list(zenoh.listen)
        wanted["listen/exit_on_failure"] = True
    else:
        wanted["connect/timeout_ms"] = 0  # a client fails at once if no router answers
    try:
        return wanted | _tls(zenoh.tls) | _user(zenoh)
    except user_files.SecretError as error:
        raise TransportError(str(error)) from None


def mode(zenoh: Zenoh) -> str:
    """Return the node's mode, which is `peer` or `client`.

    A router forwards no messages between peers, because peers connect directly. So if other peers
    cannot connect to a node, it must be a client.

    If the settings name several routers, the node must be a client too. A peer would connect to all
    routers, and receive each message from every router.
    """
    if zenoh.mode != "auto":
        return zenoh.mode
    near = is_local(zenoh.connect[0]) or not all(map(is_local, zenoh.listen))
    return "peer" if near and len(zenoh.connect) == 1 else "client"


def _tls(tls: ZenohTls | None) -> Configuration:
    if tls is None:
        return {}
    wanted: Configuration = {}
    if tls.ca:
        wanted["root_ca_certificate"] = _readable("ca", tls.ca)
    if tls.certificate and tls.private_key:
        user_files.secret("private_key", tls.private_key)
        certificate = _readable("certificate", tls.certificate)
        for side in ("connect", "listen"):
            wanted[f"{side}_certificate"] = certificate
            wanted[f"{side}_private_key"] = tls.private_key
        wanted["enable_mtls"] = True
    return {f"transport/link/tls/{key}": value for key, value in wanted.items()}


def _readable(name: str, file: str) -> str:
    try:
        user_files.read(file, 0)
        return file
    except OSError as error:
        raise TransportError(f"{name} {file} cannot be read: {error.strerror}") from None


def _user(zenoh: Zenoh) -> Configuration:
    if zenoh.user is None or zenoh.password_file is None:
        return {}
    password = user_files.secret_line("password_file", zenoh.password_file, "password")
    return {
        "transport/auth/usrpwd/user": zenoh.user,
        "transport/auth/usrpwd/password": password,
    }

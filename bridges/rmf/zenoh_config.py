"""What a zenoh session is told when it opens: as rmw_zenoh configures its own, from the YAML, and
for a node that stays on this machine.

Source: ros2/rmw_zenoh, jazzy, DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5; zenoh's DEFAULT_CONFIG.json5.
"""

import re
from typing import Any, Final

from bridges import regular_file, secret_file
from bridges.core.fields import Zenoh, ZenohTls
from bridges.rmf.transport import TransportError

LOOPBACK_PORT: Final = 17400
"""The port of domain 0 on this machine; one more for each domain. No router's (7447), not among
those that Linux hands out (from 32768)."""
RETRY: Final = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}

COMMON: Final[dict[str, Any]] = {
    "scouting/multicast/enabled": False,
    "scouting/delay": 1,  # ms: nobody is looked for, so there is nobody to wait for
    "timestamping/enabled": True,  # retained messages are ordered by it
    # A message that comes while retained ones are fetched waits for them. A node that hangs must not
    # hold a fire alarm for longer than this (ms); rmw_zenoh itself would wait for ever.
    "queries_default_timeout": 3000,
    "transport/shared_memory/enabled": False,
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "connect/retry": RETRY,
}
_LOCAL = re.compile(r"[a-z]+/(localhost|127\.[0-9.]+|\[::1\]):[0-9]+")


def is_local(endpoint: str) -> bool:
    """Whether an endpoint is on this machine's loopback."""
    return _LOCAL.fullmatch(endpoint) is not None


def on_loopback(domain_id: int) -> list[dict[str, Any]]:
    """Nodes of one domain on this machine find each other without a router, and never one.

    To be tried in turn: whoever comes first holds the domain's port, and tells those who come later
    of each other; those look for it for ever, so that another holder is found as well.
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


def on_the_site(zenoh: Zenoh) -> dict[str, Any]:
    """As the YAML says. Raises TransportError for a file that is not there, or not secret."""
    wanted = COMMON | {"mode": mode(zenoh), "connect/endpoints": list(zenoh.connect)}
    if wanted["mode"] == "peer":
        wanted["listen/endpoints"] = list(zenoh.listen)
        wanted["listen/exit_on_failure"] = True
    else:
        wanted["connect/timeout_ms"] = 0  # opening a client's session would wait for a router
    try:
        return wanted | _tls(zenoh.tls) | _user(zenoh)
    except secret_file.SecretError as error:
        raise TransportError(str(error)) from None


def mode(zenoh: Zenoh) -> str:
    """A router carries no messages from one peer to another, as peers meet directly. Where none could
    reach us we are its client, for whom it does. With several routers too: a peer would be at all of
    them, and what it says would come once by each."""
    if zenoh.mode != "auto":
        return zenoh.mode
    near = is_local(zenoh.connect[0]) or not all(map(is_local, zenoh.listen))
    return "peer" if near and len(zenoh.connect) == 1 else "client"


def _tls(tls: ZenohTls | None) -> dict[str, Any]:
    if tls is None:
        return {}
    wanted: dict[str, Any] = {}
    if tls.ca:
        wanted["root_ca_certificate"] = _readable("ca", tls.ca)
    if tls.certificate and tls.private_key:
        secret_file.content("private_key", tls.private_key)
        certificate = _readable("certificate", tls.certificate)
        for side in ("connect", "listen"):
            wanted[f"{side}_certificate"] = certificate
            wanted[f"{side}_private_key"] = tls.private_key
        wanted["enable_mtls"] = True
    return {f"transport/link/tls/{key}": value for key, value in wanted.items()}


def _readable(name: str, file: str) -> str:
    try:
        regular_file.read(file, 0)
        return file
    except OSError as error:
        raise TransportError(f"{name} {file} cannot be read: {error.strerror}") from None


def _user(zenoh: Zenoh) -> dict[str, Any]:
    if zenoh.user is None or zenoh.password_file is None:
        return {}
    password = secret_file.one_line("password_file", zenoh.password_file, "password")
    return {
        "transport/auth/usrpwd/user": zenoh.user,
        "transport/auth/usrpwd/password": password,
    }

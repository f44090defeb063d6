"""The addresses of an HTTP API: its `api_base`, and the paths of its resources below the `api_base`."""

import re
from typing import Annotated, Final, NamedTuple

import msgspec

from drivers.hal.hosts import misspelt_address

Path = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^/[A-Za-z0-9._~$/-]*(\?[A-Za-z0-9._~/:,;=&%+@!$*'()-]*)?$(?!\n)",
        max_length=256,
        extra={"pattern": "a path that begins with a slash (/relay/0?turn=on)"},
    ),
]
"""A path below `api_base`. The path may end with a query."""

PORTS: Final = {"http": 80, "https": 443}

_BASE: Final = re.compile(
    r"(?:(?P<scheme>https?)://)?"
    r"(?P<host>[A-Za-z0-9_](?:[A-Za-z0-9_.-]{0,251}[A-Za-z0-9])?|\[[0-9A-Fa-f:.]+\])"
    r"(?::(?P<port>[0-9]{1,5}))?"
    r"(?P<path>(?:/[A-Za-z0-9._~-]+)*)/?"
)


class Base(NamedTuple):
    """An `api_base`, split into its parts. `path` is "", or begins with a slash and does not end with a
    slash."""

    host: str
    port: int
    path: str
    scheme: str = "http"

    def url(self, path: str) -> str:
        """Return the address of one resource of the API."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        port = "" if self.port == PORTS[self.scheme] else f":{self.port}"
        return f"{self.scheme}://{host}{port}{self.path}{path}"


def base(text: str) -> Base:
    """Split an `api_base` into its parts. Raises ValueError with the right form."""
    if "@" in text:
        raise ValueError(
            "must not contain a user or password: write login or token_file, which name a file"
            " with the secret"
        )
    found = _BASE.fullmatch(text)
    if not found:
        raise ValueError(
            f"{text!r} is not the address of an API: write, for example, 192.168.1.60:8080/api"
        )
    scheme = found["scheme"] or "http"
    port = int(found["port"] or PORTS[scheme])
    if not 1 <= port <= 65535:
        raise ValueError(f"port {port} does not exist: ports are 1 to 65535")
    if reason := misspelt_address(found["host"]):
        raise ValueError(reason)
    return Base(found["host"].strip("[]"), port, found["path"], scheme)

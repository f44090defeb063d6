"""Commands over HTTP. This file has their settings in the YAML, and the functions that send them."""

import re
from typing import Annotated, Protocol

import msgspec

from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal import http


class Call(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One command to a controller."""

    path: Annotated[http.Path, tells("the path below the bus's `api_base`.")]
    method: Annotated[http.Method, tells("the HTTP method.")] = "POST"
    body: Annotated[
        Annotated[str, msgspec.Meta(max_length=1024)] | None,
        tells("the JSON body, as a quoted string. Without this key the request has no body."),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem for a body that is not JSON."""
        try:
            msgspec.json.decode(self.body or "{}")
        except msgspec.DecodeError as error:
            yield ("body",), f"is not JSON: {error}"


class Calls(Protocol):
    """A driver's calls on an HTTP bus."""

    def get_json(self, path: str) -> dict[str, object]:
        """Get one JSON object. Raises HalError."""

    def send(
        self, path: str, method: http.Method = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        """Send one request once. `safe` means that the request switches an output off. Raises
        HalError."""


class InsistentCalls(Calls, Protocol):
    """An HTTP bus that can also skip its backoff. Drivers need this for the last command before the
    daemon's end."""

    def insist(self) -> None:
        """Let the next request skip the backoff."""


def send(bus: Calls, call: Call | None, safe: bool = False) -> None:
    """Send this command. If the command is None, send nothing. Raises HalError."""
    if call:
        bus.send(call.path, call.method, call.body, safe)


def claim(call: Call) -> str:
    """Return the text that claims this command for one device. No other device of this bus may claim
    the same text."""
    return f"{call.method} {call.path}{f' {call.body}' if call.body else ''}"


def timer_unseen(call: Call, off_s: float) -> str:
    """Return a warning if the command does not contain the timer's time (in s or ms). Return "" if the
    command contains it."""
    written = f"{call.path} {call.body or ''}".strip()
    numbers = re.findall(r"[0-9]+(?:\.[0-9]+)?", written)
    if {off_s, 1000 * off_s}.intersection(map(float, numbers)):
        return ""
    return (
        f"the timer's time (switches_off_after_s: {off_s:g} s) is not in"
        f" {written}: compare the command with switches_off_after_s"
    )


def described(call: Call, api: http.Base) -> str:
    """Describe the command for `check`, with its method, address and body."""
    return f"{call.method} {api.url(call.path)}{f' {call.body}' if call.body else ''}"

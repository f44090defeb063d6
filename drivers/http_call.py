"""Commands over HTTP, as a YAML writes them down and as a driver sends them."""

from collections.abc import Iterable
from typing import Annotated, Any, Protocol

import msgspec

from drivers.hal import http


class Call(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One command to a controller.

    `path`: below the bus's `api_base`.
    `method`: how it is sent.
    `body`: JSON that is sent along, in quotes; nothing when absent.
    """

    path: http.Path
    method: http.Method = "POST"
    body: Annotated[str, msgspec.Meta(max_length=1024)] | None = None

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """A body that is no JSON."""
        try:
            msgspec.json.decode(self.body or "{}")
        except msgspec.DecodeError as error:
            yield ("body",), f"is no JSON: {error}"


class Calls(Protocol):
    """What a driver needs of an HTTP bus."""

    def get_json(self, path: str) -> dict[str, Any]:
        """One JSON object. Raises HalError."""

    def send(
        self, path: str, method: http.Method = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        """Once; `safe` where it takes power away. Raises HalError."""

    def insist(self) -> None:
        """Try at once what comes next."""


def send(bus: Calls, call: Call | None, safe: bool = False) -> None:
    """This command, where there is one. Raises HalError."""
    if call:
        bus.send(call.path, call.method, call.body, safe)


def told(call: Call, api: http.Base) -> str:
    """For `check`: method, address and body."""
    return f"{call.method} {api.url(call.path)}{f' {call.body}' if call.body else ''}"

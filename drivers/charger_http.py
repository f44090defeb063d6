"""A charging station that answers HTTP: `GET …/state` and `POST …/clear_error`.

The contract of the first station (a wall-mounted transmitter, TPU):

    GET  http://{api_base}/state        ->  200 {"state": 238, "error_msg": "foreign object"}
    POST http://{api_base}/clear_error  ->  2xx

It has no start, no stop and no receiver's id, so the profile is observe-only: the station decides
itself whom it charges. `codes` says what the maker's numbers mean; a number that is in no list is an
error, and none is ever passed on as if it were RMF's.
"""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Protocol

import msgspec

from bridges.charger.settings import ChargerSettings
from bridges.charger.signals import Activity, ChargerOutputs, ChargerSample
from drivers import DriverError
from drivers.hal import http
from drivers.points import Wire

BUSES = ("http",)

TEXT_MAX = 200
CODE_MAX = 65535

Code = Annotated[int, msgspec.Meta(ge=0, le=CODE_MAX)]
Path = Annotated[str, msgspec.Meta(pattern=r"^/[A-Za-z0-9._~/-]*$", max_length=256)]


class Codes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the maker's state numbers mean. A number in no list is an error, with its number.

    `idle`: nothing is on the pad, and a robot may come.
    `handshake`: a robot is being recognised, no current yet.
    `charging`: current flows.
    `stopping`: current still flows, ramping down.
    `released`: disconnected, and not ready for another robot yet.
    `error`: out of service, manual operation too.
    """

    idle: Annotated[list[Code], msgspec.Meta(min_length=1)]
    charging: Annotated[list[Code], msgspec.Meta(min_length=1)]
    handshake: list[Code] = []
    stopping: list[Code] = []
    released: list[Code] = []
    error: list[Code] = []

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """Numbers that stand twice."""
        seen: dict[int, str] = {}
        for meaning, codes in self.lists().items():
            for n, code in enumerate(codes):
                if code in seen:
                    yield (meaning, str(n)), f"state {code} is already {seen[code]}: give it once"
                seen[code] = meaning

    def lists(self) -> Mapping[Activity, list[int]]:
        """Each meaning with its numbers."""
        return {
            Activity.IDLE: self.idle,
            Activity.HANDSHAKE: self.handshake,
            Activity.CHARGING: self.charging,
            Activity.STOPPING: self.stopping,
            Activity.RELEASED: self.released,
            Activity.ERROR: self.error,
        }


class Settings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One station. The paths follow the bus's `api_base`.

    `codes`: what the maker's state numbers mean.
    `state_path`: where GET answers {"state": number, "error_msg": text}.
    `clear_error_path`: where POST clears the station's error.
    """

    codes: Codes
    state_path: Path = "/state"
    clear_error_path: Path = "/clear_error"


class Calls(Protocol):
    """What this driver needs of an HTTP bus."""

    def get_json(self, path: str) -> dict[str, Any]:
        """One JSON object. Raises HalError."""

    def post(self, path: str) -> None:
        """Once. Raises HalError."""


def create(name: str, settings: Settings, bus: Calls) -> "HttpCharger":
    """The driver of one station."""
    return HttpCharger(settings, bus)


def wires(settings: Settings) -> list[Wire]:
    """None: a station on HTTP has no contacts."""
    return []


def describe(settings: Settings, bus_settings: http.Settings) -> list[tuple[str, str]]:
    """What `check` prints in place of a wiring table: (what, meaning)."""
    api = http.base(bus_settings.api_base)
    rows = [
        ("state", f"GET {api.url(settings.state_path)} every {bus_settings.scan_s:g} s"),
        ("clear error", f"POST {api.url(settings.clear_error_path)}, {_how_often(settings)}"),
    ]
    for meaning, codes in settings.codes.lists().items():
        rows.append((f"state {meaning}", ", ".join(map(str, codes)) or "no code"))
    rows.append(("any other state", "error, with its number"))
    return rows


def warnings(settings: Settings) -> Iterable[tuple[tuple[str, ...], str]]:
    """What this profile cannot do, as (path, text)."""
    yield (
        (),
        "observe-only: without receiver_id and stop, the robot on the pad is not verified, a robot at"
        " the wrong station is not refused, and power is not switched off after a fault",
    )
    if not settings.codes.error:
        yield ("codes",), "no code means error: each of them will be shown as an unknown state"


def _how_often(settings: Settings) -> str:
    per_hour = settings.limits.clear_errors_per_h
    by_itself = f", and by itself at most {per_hour} times an hour" if per_hour else ""
    return f"when an operator resets{by_itself}"


class HttpCharger:
    """One station, read by polling. There is nothing to switch off: it keeps its own power."""

    def __init__(self, settings: Settings, bus: Calls) -> None:
        self._settings = settings
        self._bus = bus
        self._meaning = {
            code: meaning for meaning, codes in settings.codes.lists().items() for code in codes
        }
        self._cleared = 0

    def open(self) -> None:
        """Nothing to claim."""

    def read(self) -> ChargerSample:
        """The station's state now. Raises DriverError for an answer that has no meaning."""
        answer = self._bus.get_json(self._settings.state_path)
        code = _code(answer)
        activity = self._meaning.get(code, Activity.UNKNOWN)
        return ChargerSample(activity, code, _error_text(answer))

    def write(self, outputs: ChargerOutputs) -> None:
        """Clear the station's error when that is asked once more; `power` has no wire here.

        A clearing counts as done before it is sent: if its answer is lost, it is not sent again.
        """
        if outputs.clear_errors != self._cleared:
            self._cleared = outputs.clear_errors
            self._bus.post(self._settings.clear_error_path)

    def make_safe(self) -> None:
        """Nothing of ours is on: the station ends a charge by itself."""

    def close(self) -> None:
        """Nothing to let go."""


def _code(answer: dict[str, Any]) -> int:
    if "state" not in answer:
        names = ", ".join(map(_clean, list(answer)[:5])) or "nothing"
        raise DriverError(f"the answer has no 'state', but {names}: is state_path right?")
    code = answer["state"]
    if not isinstance(code, int) or isinstance(code, bool):
        raise DriverError(f"'state' is {_clean(repr(code), 40)}, and a whole number is expected")
    if not 0 <= code <= CODE_MAX:
        raise DriverError(f"'state' is {_clean(str(code), 40)}, and 0 to {CODE_MAX} is expected")
    return code


def _error_text(answer: dict[str, Any]) -> str:
    """The station's own words; absent and null say nothing."""
    text = answer.get("error_msg")
    if text is None:
        return ""
    if not isinstance(text, str):
        raise DriverError(f"'error_msg' is {_clean(repr(text), 40)}, and a text is expected")
    return _clean(text)


def _clean(text: str, longest: int = TEXT_MAX) -> str:
    """On one line, printable, and not long: it goes into a message and into the log."""
    text = "".join(c if c.isprintable() else " " for c in text[: 4 * longest])
    text = " ".join(text.split())
    return text if len(text) <= longest else f"{text[: longest - 1]}…"

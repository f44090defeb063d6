"""A charging station that speaks HTTP and JSON.

The defaults fit the station for which this driver was first written (a wall-mounted transmitter, TPU).
That station has this interface:

    GET  http://{api_base}/state        ->  200 {"state": 238, "error_msg": "foreign object"}
    POST http://{api_base}/clear_error  ->  2xx

This interface has no start, no stop and no receiver id. So the driver can only observe the station, and
the station itself decides which robot it charges. For other makes the YAML gives paths and fields.

`codes` gives the meanings of the maker's states. A state that `codes` does not list counts as a fault
of the station. The driver never passes a maker's state on as an RMF state.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated

from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from drivers.charger import json_station
from drivers.charger.json_station import POWER, JsonCharger, JsonChargerSettings, StationCommand
from drivers.driver_type import DriverType
from drivers.hal import http
from drivers.http_call import Call, Calls, claim, described, send, timer_unseen


class HttpChargerSettings(
    JsonChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True
):
    """One station. Every path is relative to the bus's `api_base`."""

    state_path: Annotated[http.Path, tells("the path that GET reads the state from.")] = "/state"
    clear_error_path: Annotated[
        http.Path | None,
        tells("""the path where POST clears the error. Write `null` for a station without such a
        path."""),
    ] = "/clear_error"
    start: Annotated[Call | None, tells("switches the power on for the robot on the pad.")] = None
    stop: Annotated[Call | None, tells("switches the power off.")] = None
    range_check: Annotated[
        Call | None, tells("orders a check of the robot's position, if the station needs an order.")
    ] = None

    def command(self, name: StationCommand) -> Call | None:
        """Return the call for this command. Return None if the station has no such command."""
        if name == "clear_error":
            return Call(path=self.clear_error_path) if self.clear_error_path else None
        found: Call | None = getattr(self, name)
        return found


class HttpStationCalls:
    """Access to a station by HTTP calls (`drivers.charger.json_station.JsonStation`)."""

    def __init__(self, settings: HttpChargerSettings, bus: Calls) -> None:
        self._settings = settings
        self._bus = bus

    def answer(self) -> Mapping[str, object]:
        """Return the answer to `GET state_path`."""
        return self._bus.get_json(self._settings.state_path)

    def send(self, name: StationCommand, safe: bool = False) -> None:
        """Send this command once, if the station has it."""
        send(self._bus, self._settings.command(name), safe)


def create(name: str, settings: HttpChargerSettings, bus: Calls) -> JsonCharger:
    """Make the station's driver on its bus. The driver sends nothing before the first reading."""
    return JsonCharger(settings, HttpStationCalls(settings, bus))


def claims(settings: HttpChargerSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the station's state (a field of a path) and each command, with its path in the YAML. No
    other charger may use the same state or command."""
    yield f"{settings.fields.state} of {settings.state_path}", ("state_path",)
    for name in ("start", "stop"):
        if call := getattr(settings, name):
            yield claim(call), (name, "path")


def describe(
    settings: HttpChargerSettings, bus_settings: http.HttpSettings
) -> list[tuple[str, str]]:
    """Return the rows that `check` prints instead of a wiring table. Each row is a subject and its
    meaning."""
    api = http.base(bus_settings.api_base)
    rows = [("state", f"GET {api.url(settings.state_path)} every {bus_settings.scan_s:g} s")]
    for what in ("start", "stop", "range_check"):
        if call := getattr(settings, what):
            rows.append((what.replace("_", " "), described(call, api)))
    rows += json_station.power_off(settings, bus_settings.scan_s)
    if settings.clear_error_path:
        clear = f"POST {api.url(settings.clear_error_path)}, {json_station.how_often(settings)}"
        rows.append(("clear error", clear))
    return rows + json_station.rows(settings)


def warnings(settings: HttpChargerSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each missing ability. Yield a warning for each
    valid setting that may be a mistake."""
    off_s, unseen = settings.switches_off_after_s, []
    if settings.start and off_s is not None and (text := timer_unseen(settings.start, off_s)):
        unseen = [(("start", "path"), text)]
    return json_station.warnings(settings, unseen)


DRIVER = DriverType(
    settings=HttpChargerSettings,
    buses=("http",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=warnings,
    unwired=lambda settings: (POWER,) if settings.start else (),
    fake="hal_fakes.http_charger",
)

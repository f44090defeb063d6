"""A charging station that speaks HTTP and JSON.

The interface of the first station (a wall-mounted transmitter, TPU):

    GET  http://{api_base}/state        ->  200 {"state": 238, "error_msg": "foreign object"}
    POST http://{api_base}/clear_error  ->  2xx

It has no start, no stop and no receiver id, so it can only be observed: the station itself decides
which robot it charges. For other makes the YAML gives paths and fields. `codes` gives the meanings of
the maker's states; an unlisted state is an error. A maker's state is never passed on as an RMF state.
"""

from collections.abc import Iterator
from typing import Annotated, Final

import msgspec

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import AT_FAULT, Activity, ChargerOutputs, ChargerSample
from bridges.kinds.shared.fields import Timeout, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import json_fields
from drivers.charger import rules
from drivers.charger.http_fields import Fields, Word
from drivers.charger.rules import Rule, StationErrors, judged
from drivers.charger.state_codes import Code, Codes
from drivers.driver_type import DriverType
from drivers.hal import http
from drivers.http_call import Call, Calls, claim, described, send, timer_unseen
from drivers.unsafe import unaccepted

POWER: Final = "power"


class HttpChargerSettings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One station. The paths follow the bus's `api_base`."""

    codes: Annotated[
        Codes | None, tells("the meanings of the maker's state numbers; not needed with `rules`.")
    ] = None
    rules: Annotated[
        list[Rule], tells("the state by other fields of the answer; tried before `codes`.")
    ] = msgspec.field(default_factory=list)
    errors: Annotated[StationErrors, tells("fields that mean an error, whatever the state is.")] = (
        StationErrors()
    )
    state_words: Annotated[
        dict[Word, Code],
        tells("word -> its number in `codes`, for a station that names its states."),
    ] = msgspec.field(default_factory=dict)
    state_path: Annotated[http.Path, tells("the path that GET reads the state from.")] = "/state"
    fields: Annotated[Fields, tells("the fields of that answer.")] = Fields()
    clear_error_path: Annotated[
        http.Path | None, tells("the path where POST clears the error; `null` where there is none.")
    ] = "/clear_error"
    start: Annotated[Call | None, tells("switches the power on for the robot on the pad.")] = None
    switches_off_after_s: Annotated[
        Timeout | None,
        tells("""the timer that `start` sets; the power goes off this long after the last `start`,
        so `start` is sent in every scan while the power is on."""),
    ] = None
    stop: Annotated[Call | None, tells("switches the power off.")] = None
    range_check: Annotated[
        Call | None, tells("orders a check of the robot's position, if the station needs an order.")
    ] = None

    def off_after(self) -> tuple[float, tuple[str, ...]] | None:
        """Return the power's timer (s) and its path in the YAML; None if there is no timer."""
        path = ("switches_off_after_s",)
        return None if self.switches_off_after_s is None else (self.switches_off_after_s, path)

    def can_stop(self) -> bool:
        """Can the driver switch the power off? Only if the YAML has `stop`."""
        return self.stop is not None

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        yield from rules.problems(self.rules, self.codes is not None)
        yield from _place_problems(self)
        yield from _timer_problems(self)
        if self.receivers and self.fields.receiver_id is None:
            text = "receivers needs the field with the id of the receiver that the station sees"
            yield ("fields", "receiver_id"), text
        if self.start and not self.stop:
            yield ("start",), "needs stop as well: a charge that cannot be stopped is not started"
        if self.range_check and self.fields.in_range is None:
            yield ("fields", "in_range"), "range_check needs the field with the check's result"
        if self.on_death == "keep" and self.stop is None:
            yield ("on_death",), "this station cannot be stopped: delete on_death"


def _place_problems(settings: HttpChargerSettings) -> Remarks:
    looked_at = [(("rules", *path), at) for path, at in rules.places(settings.rules)]
    looked_at += [(("errors", *path), at) for path, at in settings.errors.places()]
    for path, at in looked_at:
        if not json_fields.is_field(at):
            yield path, f"{at!r} is not a field: write names with dots between them (status.code)"


def _timer_problems(settings: HttpChargerSettings) -> Remarks:
    """Yield problems with the timer of a relay: only the timer can act when the network is gone."""
    timer = settings.switches_off_after_s
    if timer and not settings.start:
        yield (
            ("switches_off_after_s",),
            "start sets this timer: give start, or delete switches_off_after_s",
        )
    if timer and settings.on_death == "keep":
        yield ("on_death",), "the station switches off when start is not repeated: delete on_death"
    if settings.start and settings.codes is None and timer is None:
        text = (
            "when the network dies nothing switches the power off: let start set the relay's own"
            " timer, and write its time as switches_off_after_s"
        )
        yield from unaccepted([(POWER, ("switches_off_after_s",), text)], settings.accept_unsafe)


def create(name: str, settings: HttpChargerSettings, bus: Calls) -> "HttpCharger":
    """Make the station's driver on its bus; it sends nothing before the first reading."""
    return HttpCharger(settings, bus)


def claims(settings: HttpChargerSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield (place, path) of the station's own state and commands: no other charger may use them."""
    yield f"{settings.fields.state} of {settings.state_path}", ("state_path",)
    for name in ("start", "stop"):
        if call := getattr(settings, name):
            yield claim(call), (name, "path")


def describe(
    settings: HttpChargerSettings, bus_settings: http.HttpSettings
) -> list[tuple[str, str]]:
    """Return rows that `check` prints instead of a wiring table: (subject, meaning)."""
    api = http.base(bus_settings.api_base)
    rows = [("state", f"GET {api.url(settings.state_path)} every {bus_settings.scan_s:g} s")]
    for what in ("start", "stop", "range_check"):
        if call := getattr(settings, what):
            rows.append((what.replace("_", " "), described(call, api)))
    if settings.switches_off_after_s:
        after = f"{settings.switches_off_after_s:g} s without a new start"
        rows.append(("power off", f"by itself after {after}, sent every {bus_settings.scan_s:g} s"))
    if settings.clear_error_path:
        clear = f"POST {api.url(settings.clear_error_path)}, {_how_often(settings)}"
        rows.append(("clear error", clear))
    rows += settings.fields.rows(has_codes=settings.codes is not None)
    rows += [(f"word {word}", str(code)) for word, code in settings.state_words.items()]
    rows += rules.rows(settings.rules, settings.errors)
    if settings.codes:
        rows += settings.codes.rows()
    rows += [(f"receiver {known}", who) for known, who in settings.receivers.items()]
    if settings.stop:
        rows.append(("on death", settings.on_death))
    return rows


def warnings(settings: HttpChargerSettings) -> Remarks:
    """Yield (path, text) for missing abilities, and for settings that deserve a second look."""
    missing = [name for name in ("receiver_id", "stop") if _lacks(settings, name)]
    consequences = {
        "receiver_id": "the robot on the pad is not verified, and a robot at the wrong station is"
        " not refused",
        "stop": "power is not switched off after a fault",
    }
    if missing:
        sort = "observe-only: " if settings.stop is None else ""
        what = ", and ".join(consequences[name] for name in missing)
        yield (), f"{sort}without {' and '.join(missing)}, {what}"
    if not _lacks(settings, "receiver_id") and not settings.receivers:
        yield ("fields",), "receiver_id is read, but without receivers no robot is verified"
    off_s = settings.switches_off_after_s
    if settings.start and off_s is not None and (text := timer_unseen(settings.start, off_s)):
        yield ("start", "path"), text
    if settings.codes and not settings.codes.error:
        yield (
            ("codes",),
            "no code is listed as an error: an error will be shown as an unknown state",
        )

    known = settings.codes.meanings() if settings.codes else {}
    for word, code in settings.state_words.items():
        if word in ("true", "false"):
            text = f'matches the text "{word}" and no JSON {word}: for that write rules:'
            yield ("state_words", word), text
        if code not in known:
            yield ("state_words", word), f"{code} is not in codes: an unknown state"


def _lacks(settings: HttpChargerSettings, what: str) -> bool:
    return (settings.stop if what == "stop" else settings.fields.receiver_id) is None


def _how_often(settings: HttpChargerSettings) -> str:
    per_hour = settings.limits.clear_errors_per_h
    by_itself = f", and by itself at most {per_hour} times an hour" if per_hour else ""
    return f"when an operator resets{by_itself}"


class HttpCharger:
    """`drivers.Driver` for one station.

    Power is a level: `start` is repeated while the station stays idle, `stop` while it still charges.
    """

    def __init__(self, settings: HttpChargerSettings, bus: Calls) -> None:
        self._settings = settings
        self._bus = bus
        self._activity = Activity.UNKNOWN
        self._at_fault = False
        self._power: bool | None = None
        self._cleared = 0
        self._checked = 0

    def open(self) -> None:
        """Do nothing: a restart must not end a charge."""

    def read(self) -> ChargerSample:
        """Read and decode the station's state. Raises DriverError for an answer without sense."""
        answer = self._bus.get_json(self._settings.state_path)
        fields = self._settings.fields
        has_codes = self._settings.codes is not None
        code = fields.code(answer, self._settings.state_words) if has_codes else None
        said, side = fields.error(answer)
        found = judged(self._settings, lambda at: json_fields.needed(answer, at), code, side)
        shown = Activity.ERROR if said else found.activity
        self._activity, self._at_fault = found.does, shown in AT_FAULT
        return ChargerSample(
            shown,
            found.code,
            "; ".join(filter(None, (found.text, said))),
            fields.measured(answer),
            found.side,
            charges=shown is Activity.ERROR and found.does is Activity.CHARGING,
        )

    def write(self, outputs: ChargerOutputs) -> None:
        """Set the power, off first.

        A clear or a range check is sent once, even if its answer is lost, because it counts as done
        before sending.
        """
        if outputs.power is False:
            self._stop_if_needed()
        if outputs.clear_errors != self._cleared:
            self._cleared = outputs.clear_errors
            if self._settings.clear_error_path:
                self._bus.send(self._settings.clear_error_path)
        if outputs.range_checks != self._checked:
            self._checked = outputs.range_checks
            send(self._bus, self._settings.range_check)
        if outputs.power:
            self._start_if_needed()
        self._power = outputs.power

    def make_safe(self) -> None:
        """Switch the power off; with `on_death: keep` do nothing."""
        if self._settings.on_death == "stop":
            send(self._bus, self._settings.stop, safe=True)

    def close(self) -> None:
        """Do nothing: the driver holds no resource."""

    def _stop_if_needed(self) -> None:
        given, self._power = self._power, None
        on = self._activity in (Activity.HANDSHAKE, Activity.CHARGING)
        if on or (given is not False and self._at_fault):
            send(self._bus, self._settings.stop, safe=True)

    def _start_if_needed(self) -> None:
        given, self._power = self._power, None
        waits = self._activity is Activity.IDLE
        renewed = self._settings.switches_off_after_s and self._activity not in AT_FAULT
        if waits or renewed or (not given and self._activity is Activity.HANDSHAKE):
            send(self._bus, self._settings.start)


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

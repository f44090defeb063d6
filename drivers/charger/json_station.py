"""A charging station that answers with JSON over HTTP or MQTT. This file has the station's settings,
the checks of these settings, and the driver.

`codes` gives the meanings of the maker's states. A state that `codes` does not list counts as a fault
of the station. The driver never passes a maker's state on as an RMF state.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Final, Literal, Protocol

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
from drivers.unsafe import unaccepted

POWER: Final = "power"
StationCommand = Literal["start", "stop", "range_check", "clear_error"]


class JsonChargerSettings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One station. The settings of each bus type add the commands."""

    codes: Annotated[
        Codes | None, tells("the meanings of the maker's state numbers; not needed with `rules`.")
    ] = None
    rules: Annotated[
        list[Rule],
        tells("""rules that give the state from other fields of the answer. The driver tries them
        before `codes`."""),
    ] = msgspec.field(default_factory=list)
    errors: Annotated[StationErrors, tells("fields that mean an error, whatever the state is.")] = (
        StationErrors()
    )
    state_words: Annotated[
        dict[Word, Code],
        tells("word -> its number in `codes`, for a station that names its states."),
    ] = msgspec.field(default_factory=dict)
    fields: Annotated[Fields, tells("the fields of the answer.")] = Fields()
    switches_off_after_s: Annotated[
        Timeout | None,
        tells("""the timer that `start` sets. The power goes off this long after the last `start`,
        so the driver sends `start` in every scan while the power is on."""),
    ] = None

    def command(self, name: StationCommand) -> Any:
        """Return this command as the bus sends it: an HTTP call or an MQTT message. Return None if the
        station has no such command."""
        return getattr(self, name)

    def off_after(self) -> tuple[float, tuple[str, ...]] | None:
        """Return the time (s) after which the power goes off by itself, and the path of this time in
        the YAML. Return None without such a timer."""
        path = ("switches_off_after_s",)
        return None if self.switches_off_after_s is None else (self.switches_off_after_s, path)

    def can_stop(self) -> bool:
        """Return whether the driver can switch the power off. It can do so only if the YAML gives
        `stop`."""
        return self.command("stop") is not None

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        yield from rules.problems(self.rules, self.codes is not None)
        yield from _place_problems(self)
        yield from _timer_problems(self)
        if self.receivers and self.fields.receiver_id is None:
            text = "receivers needs the field with the id of the receiver that the station sees"
            yield ("fields", "receiver_id"), text
        if self.command("start") and not self.command("stop"):
            yield (
                ("start",),
                "needs stop too, because the driver starts no charge that it cannot stop",
            )
        if self.command("range_check") and self.fields.in_range is None:
            yield ("fields", "in_range"), "range_check needs the field with the check's result"
        if self.on_death == "keep" and self.command("stop") is None:
            yield (
                ("on_death",),
                "has no effect, because the driver cannot stop this station: delete on_death",
            )


def _place_problems(settings: JsonChargerSettings) -> Remarks:
    looked_at = [(("rules", *path), at) for path, at in rules.places(settings.rules)]
    looked_at += [(("errors", *path), at) for path, at in settings.errors.places()]
    for path, at in looked_at:
        if not json_fields.is_field(at):
            yield path, f"{at!r} is not a field: write names with dots between them (status.code)"


def _timer_problems(settings: JsonChargerSettings) -> Remarks:
    """Yield problems with the station's timer, which switches the power off. When the network is gone,
    only this timer can switch the power off."""
    timer = settings.switches_off_after_s
    if timer and not settings.command("start"):
        yield (
            ("switches_off_after_s",),
            "start sets this timer: give start, or delete switches_off_after_s",
        )
    if timer and settings.on_death == "keep":
        yield (
            ("on_death",),
            "has no effect, because the station switches off by itself when start is not repeated:"
            " delete on_death",
        )
    if settings.command("start") and settings.codes is None and timer is None:
        text = (
            "when the network dies nothing switches the power off: let start set the"
            " relay's own timer, and write the timer's time as switches_off_after_s"
        )
        yield from unaccepted([(POWER, ("switches_off_after_s",), text)], settings.accept_unsafe)


def rows(settings: JsonChargerSettings) -> list[tuple[str, str]]:
    """Return rows for `check` about the fields, and about the meanings of states. Each row is a pair of
    a subject and its meaning."""
    found = [*settings.fields.rows(has_codes=settings.codes is not None)]
    found += [(f"word {word}", str(code)) for word, code in settings.state_words.items()]
    found += rules.rows(settings.rules, settings.errors)
    if settings.codes:
        found += settings.codes.rows()
    found += [(f"receiver {known}", who) for known, who in settings.receivers.items()]
    if settings.command("stop"):
        found.append(("on death", settings.on_death))
    return found


def power_off(settings: JsonChargerSettings, scan_s: float) -> Iterator[tuple[str, str]]:
    """Yield a row about the timer that switches the power off, if the station has such a timer."""
    if settings.switches_off_after_s:
        after = f"{settings.switches_off_after_s:g} s without a new start"
        yield "power off", f"by itself after {after}; the driver sends start every {scan_s:g} s"


def warnings(settings: JsonChargerSettings, unseen_timer: Remarks = ()) -> Remarks:
    """Yield a warning, with its path in the YAML, for each missing ability. Yield a warning for each
    valid setting that may be a mistake.

    `unseen_timer` is the warning about a `start` command that does not contain the timer's time.
    """
    missing = [name for name in ("receiver_id", "stop") if _lacks(settings, name)]
    consequences = {
        "receiver_id": "the robot on the pad is not verified, and a robot at the wrong station is"
        " not refused",
        "stop": "power is not switched off after a fault",
    }
    if missing:
        sort = "observe-only: " if settings.command("stop") is None else ""
        what = ", and ".join(consequences[name] for name in missing)
        yield (), f"{sort}without {' and '.join(missing)}, {what}"
    if not _lacks(settings, "receiver_id") and not settings.receivers:
        yield ("fields",), "receiver_id is read, but without receivers no robot is verified"
    yield from unseen_timer
    if settings.codes and not settings.codes.error:
        yield (
            ("codes",),
            "no code is listed under error, so an error of the station shows as an unknown state",
        )

    known = settings.codes.meanings() if settings.codes else {}
    for word, code in settings.state_words.items():
        if word in ("true", "false"):
            text = (
                f'matches the text "{word}", but not the JSON value {word}: for the JSON value'
                " write rules:"
            )
            yield ("state_words", word), text
        if code not in known:
            yield ("state_words", word), f"{code} is not in codes, so this state is unknown"


def _lacks(settings: JsonChargerSettings, what: str) -> bool:
    return (settings.command("stop") if what == "stop" else settings.fields.receiver_id) is None


def how_often(settings: JsonChargerSettings) -> str:
    """Describe the occasions on which the driver clears errors."""
    per_hour = settings.limits.clear_errors_per_h
    by_itself = f", and by itself at most {per_hour} times an hour" if per_hour else ""
    return f"when an operator resets{by_itself}"


class JsonStation(Protocol):
    """The station behind a charger's driver. Each call raises HalError."""

    def answer(self) -> Mapping[str, object]:
        """Return the station's present state."""

    def send(self, name: StationCommand, safe: bool = False) -> None:
        """Send this command once. Send nothing if the station has no such command. `safe` means that
        the command switches the power off."""


class JsonCharger:
    """The driver of one station (`drivers.Driver`).

    The driver knows only whether the power should be on or off. So it repeats `start` while the station
    stays idle, and repeats `stop` while the station still charges.
    """

    def __init__(self, settings: JsonChargerSettings, station: JsonStation) -> None:
        self._settings = settings
        self._station = station
        self._activity = Activity.UNKNOWN
        self._at_fault = False
        self._power: bool | None = None
        self._cleared = 0
        self._checked = 0

    def open(self) -> None:
        """Do nothing, because a restart must not end a charge."""

    def read(self) -> ChargerSample:
        """Read and decode the station's state. Raises DriverError for an answer that makes no sense.

        After a failed reading the station may charge or not. Then `stop` is sent once, and no `start`.
        """
        self._activity, self._at_fault = Activity.UNKNOWN, True
        answer = self._station.answer()
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
        """Send the commands that the outputs need: first `stop`, then the other commands, and last
        `start`.

        For each request the driver sends `clear_error` and `range_check` at most once, even if the
        answer is lost. So the driver counts each of these two commands as done before it sends the
        command.
        """
        if outputs.power is False:
            self._stop_if_needed()
        if outputs.clear_errors != self._cleared:
            self._cleared = outputs.clear_errors
            self._station.send("clear_error")
        if outputs.range_checks != self._checked:
            self._checked = outputs.range_checks
            self._station.send("range_check")
        if outputs.power:
            self._start_if_needed()
        self._power = outputs.power

    def make_safe(self) -> None:
        """Switch the power off. With `on_death: keep` do nothing."""
        if self._settings.on_death == "stop":
            self._station.send("stop", safe=True)

    def close(self) -> None:
        """Do nothing, because the driver holds no resource."""

    def _stop_if_needed(self) -> None:
        given, self._power = self._power, None
        on = self._activity in (Activity.HANDSHAKE, Activity.CHARGING)
        if on or (given is not False and self._at_fault):
            self._station.send("stop", safe=True)

    def _start_if_needed(self) -> None:
        given, self._power = self._power, None
        waits = self._activity is Activity.IDLE
        renewed = self._settings.switches_off_after_s and self._activity not in AT_FAULT
        if waits or renewed or (not given and self._activity is Activity.HANDSHAKE):
            self._station.send("start")

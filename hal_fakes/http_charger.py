"""A charging station on HTTP. It shows its plant's state in the maker's fields, as numbers or words.

`GET state_path` answers this state. The commands clear an error, start, stop and check the range.
"""

import json
import time
from collections.abc import Iterator, Mapping, Sequence

from bridges.kinds.charger.signals import Activity
from drivers.charger.http import HttpChargerSettings
from drivers.charger.json_station import JsonChargerSettings
from drivers.charger.rules import places
from drivers.charger.state_codes import ROBOT_ERROR
from drivers.json_fields import Value, found
from hal_fakes.charger_values import NEAREST, values
from hal_fakes.fake import Fake
from hal_fakes.http import Asked
from hal_fakes.json_answers import asked, put, value_of
from hal_fakes.plants.charger import ChargerPlant, Reading
from hal_fakes.plants.plant import Plant


def build(
    name: str, settings: JsonChargerSettings, links: Sequence[str] = ("server", "headers", "body")
) -> ChargerPlant:
    """Build the station for these settings. Its pad knows the robots in `receivers` of the settings."""
    return ChargerPlant(
        name,
        settings.receivers,
        commanded=settings.can_stop(),
        asked=settings.command("range_check") is not None,
        cleared=settings.command("clear_error") is not None,
        links=links,
    )


class FakeJsonCharger:
    """A station that answers with JSON. It shows its one plant in the maker's fields, numbers and
    words."""

    def __init__(self, plant: Plant, settings: JsonChargerSettings) -> None:
        self.plant = plant
        self._settings = settings
        self._lists = settings.codes.lists() if settings.codes else {}
        self._off_at = float("inf")
        self._words: Mapping[int | str, str] = {
            code: word for word, code in settings.state_words.items()
        }
        self._last: bytes | None = None

    def reading(self) -> Reading:
        """Return the station's present reading."""
        self.plant.advance(time.monotonic())
        reading = self.plant.reading()
        assert isinstance(reading, Reading)
        return reading

    def obey(self, signal: str, asserted: bool) -> None:
        """Obey a command for this signal."""
        now, after_s = time.monotonic(), self._settings.switches_off_after_s
        if signal == "power":
            self._off_at = now + after_s if asserted and after_s else float("inf")
        self.plant.drive(signal, asserted, now)

    def tick(self) -> None:
        """Switch the power off when its timer has run out."""
        if time.monotonic() >= self._off_at:
            self.obey("power", False)

    def answer(self, asked: Asked) -> bytes:
        """Return the present answer to `GET state_path`."""
        return self.body(self.reading())

    def body(self, reading: Reading) -> bytes:
        """Return the answer for this reading. If the server or the body fails, return the spoilt answer
        of the failure mode."""
        server, body = reading.failures.get("server"), reading.failures.get("body")
        if server == "stuck" and self._last is not None:
            return self._last
        code: int | str = ""
        if self._settings.codes is not None:
            code = self._unknown() if body == "wrong" else self._code(reading)
        if server == "wrong":
            code = str(code)
        answer = self._answer(code, reading)
        if "wrong" in (server, body):
            for _, at in places(self._settings.rules):
                put(answer, at.split(".")[0], None)
        self._last = json.dumps(answer).encode()
        return {"off": b"", "garbage": self._last[:-9]}.get(body or "", self._last)

    def _answer(self, code: int | str, reading: Reading) -> dict[str, object]:
        """Return all values in the fields that the YAML names."""
        fields, answer = self._settings.fields, dict[str, object]()
        if self._settings.codes is not None:
            put(answer, fields.state, self._words.get(code, code))
            put(answer, fields.error_text, reading.error_text)
        if fields.receiver_id:
            put(answer, fields.receiver_id, reading.receiver or None)
        for name in ("in_range", "range_ok", "at_height"):
            if where := getattr(fields, name):
                put(answer, where.field, value_of(where, bool(getattr(reading, name))))
        for number in fields.temperatures.values():
            put(answer, number.field, reading.celsius / number.scale)
        percent = None if reading.battery is None else 100 * reading.battery
        for name, value in (("battery_percent", percent), *_numbers(reading)):
            if number := getattr(fields, name):
                put(answer, number.field, None if value is None else value / number.scale)
        for at, shown in self._by_rules(reading, answer).items():
            put(answer, at, shown)
        return answer

    def _by_rules(self, reading: Reading, answer: dict[str, object]) -> dict[str, Value]:
        """Return a value for each field that a rule or an error of the YAML reads."""
        said = self._settings
        wanted = ROBOT_ERROR if reading.robots else (reading.activity, "")
        shown = {at: found(answer, at) for _, at in places(said.rules)}
        natural = {at: value for at, value in shown.items() if isinstance(value, Value)}
        return values(said.rules, said.errors, wanted, natural) or {}

    def _code(self, reading: Reading) -> int:
        own = self._settings.codes
        if own and own.robot_error and reading.robots:
            return own.robot_error[0]
        nearest = NEAREST.get(reading.activity, Activity.ERROR)
        codes = self._lists[reading.activity] or self._lists[nearest] or [self._unknown()]
        return codes[min(int(reading.progress * len(codes)), len(codes) - 1)]

    def _unknown(self) -> int:
        known = {code for codes in self._lists.values() for code in codes}
        return next(code for code in range(100, 65536) if code not in known)


class FakeHttpCharger(FakeJsonCharger):
    """A station (`hal_fakes.http.HttpStation`) with its maker's paths."""

    def __init__(self, plant: Plant, settings: HttpChargerSettings) -> None:
        super().__init__(plant, settings)
        self.reads: Sequence[Asked] = [("GET", settings.state_path, "")]
        self.commands: Mapping[Asked, tuple[str, bool]] = dict(_commands(settings))


def _commands(settings: HttpChargerSettings) -> Iterator[tuple[Asked, tuple[str, bool]]]:
    """Yield each command as a request, with its effect on the plant."""
    if settings.clear_error_path:
        yield ("POST", settings.clear_error_path, ""), ("clear_error", True)
    for call, signal, asserted in (
        (settings.start, "power", True),
        (settings.stop, "power", False),
        (settings.range_check, "range_check", True),
    ):
        if call:
            yield asked(call), (signal, asserted)


def _numbers(reading: Reading) -> list[tuple[str, float | None]]:
    names = ("volts", "amps", "time_to_full_s")
    return [(name, getattr(reading, name)) for name in names]


FAKE = Fake[HttpChargerSettings](
    plant=lambda name, settings, wires: build(name, settings),
    station=lambda plant, settings: FakeHttpCharger(plant, settings),
)

"""The fields of a charging station's HTTP answer, and the values that the driver reads from the
fields."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Final, Literal

import msgspec

from bridges.kinds.charger.signals import FaultSide, Measured
from bridges.kinds.shared.fields import Name, tells
from drivers import json_fields
from drivers.charger.state_codes import CODE_MAX
from drivers.json_fields import Field, JsonFlag, JsonNumber

Answer = Mapping[str, object]
"""One JSON object."""
WORD_MAX: Final = 64
Word = Annotated[str, msgspec.Meta(min_length=1, max_length=WORD_MAX)]
TextMeans = Literal["none", "station", "robot"]
WEEK_S: Final = 7 * 86400


class Fields(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of the answer to `state_path`. A field is a path of names that are joined by dots."""

    state: Annotated[
        Field, tells("the field of the station's state. `codes` has the meanings.")
    ] = "state"
    error_text: Annotated[
        Field,
        tells("""the field of the station's error text. Any text means an error, whatever the state
        is, unless `error_texts` gives `none` for this text."""),
    ] = "error_msg"
    error_texts: Annotated[
        dict[Word, TextMeans],
        tells("""error text -> the side that is at fault, `station` or `robot`. Write `none` for a
        text that means no error (`OK`). For a text that is not listed here, `codes` may give the
        side."""),
    ] = {}
    receiver_id: Annotated[
        Field | None,
        tells("""the id of the receiver on the pad. Without a receiver the field is null or ""."""),
    ] = None
    in_range: Annotated[JsonFlag | None, tells("the robot stands where charging is possible.")] = (
        None
    )
    range_ok: Annotated[
        JsonFlag | None,
        tells("""the robot is within the station's range. Give this flag if the station reports it at
        all times. The daemon switches the power on only while the flag is true."""),
    ] = None
    at_height: Annotated[
        JsonFlag | None,
        tells("""the station's moving pad is in its charging position. The daemon switches the power
        on only while the flag is true. If the flag becomes false while current flows, this is a
        fault."""),
    ] = None
    volts: Annotated[JsonNumber | None, tells("the voltage at the battery.")] = None
    amps: Annotated[JsonNumber | None, tells("the current into the battery.")] = None
    battery_percent: Annotated[JsonNumber | None, tells("the battery's charge, 0 to 100.")] = None
    time_to_full_s: Annotated[
        JsonNumber | None, tells("the time until the battery is full (s).")
    ] = None
    temperatures: Annotated[
        dict[Name, JsonNumber],
        tells("name -> a temperature (°C), shown in status and diagnostics."),
    ] = {}

    def code(self, answer: Answer, words: Mapping[str, int]) -> int | str:
        """Return the maker's number for the station's state. If the state is a word that `words` does
        not list, return the word.

        Raises DriverError for a state that is neither a number nor a word.
        """
        code = json_fields.needed(answer, self.state)
        if words and isinstance(code, str):
            word = json_fields.clean(code, WORD_MAX)
            return words.get(word, word)
        if words or not isinstance(code, int) or isinstance(code, bool):
            raise json_fields.wrong(self.state, code, "a text" if words else "a whole number")
        if not 0 <= code <= CODE_MAX:
            raise json_fields.wrong(self.state, code, f"0 to {CODE_MAX}")
        return code

    def error(self, answer: Answer) -> tuple[str, FaultSide]:
        """Return the text of the error that the station reports, and the side that is at fault (station
        or robot). Raises DriverError."""
        said = json_fields.text(answer, self.error_text)
        means = self.error_texts.get(said)
        return ("", "") if means == "none" else (said, means or "")

    def measured(self, answer: Answer) -> Measured:
        """Return the receiver's id and the measurements. A flag that is null counts as false. Raises
        DriverError."""
        celsius = ((name, _number(answer, at)) for name, at in self.temperatures.items())
        return Measured(
            receiver_id=self.receiver_id and json_fields.name(answer, self.receiver_id),
            in_range=json_fields.flag_if(answer, self.in_range),
            volts=_number(answer, self.volts),
            amps=_number(answer, self.amps),
            battery_percent=_number(answer, self.battery_percent, 100, "0 to 100"),
            time_to_full_s=_number(answer, self.time_to_full_s, WEEK_S, "0 s to a week"),
            range_ok=json_fields.flag_if(answer, self.range_ok),
            at_height=json_fields.flag_if(answer, self.at_height),
            temperatures=tuple((name, value) for name, value in celsius if value is not None),
        )

    def rows(self, has_codes: bool) -> Iterator[tuple[str, str]]:
        """Yield rows for `check` about the fields. Yield no row if all fields have their defaults
        (`drivers/charger/http.py`)."""
        for name in self.__struct_fields__ if self != Fields() else ():
            place = getattr(self, name)
            if place and not isinstance(place, dict) and (has_codes or name != "state"):
                yield f"field {name}", _place(place)
        for name, number in self.temperatures.items():
            yield f"temperature {name}", _place(number)
        for text, means in self.error_texts.items():
            yield f"text {text}", "no error" if means == "none" else f"{means}'s error"


def _number(
    answer: Answer, number: JsonNumber | None, most: float = math.inf, bounds: str = ""
) -> float | None:
    """Return the value, scaled to the unit that the driver uses. Raises DriverError for a value that is
    not a number, or that is out of bounds."""
    value = json_fields.number(answer, number.field, number.scale) if number else None
    if number and value is not None and bounds and not 0 <= value <= most:
        raise json_fields.wrong(number.field, value, bounds)
    return value


def _place(place: str | JsonNumber | JsonFlag) -> str:
    return place if isinstance(place, str) else json_fields.place_text(place)

"""Rules that find out a charging station's state, and the errors that the station reports. HTTP, MQTT,
Modbus and CAN stations use these rules.

A rule tests the values of named places. A place is a field of a JSON answer, a name in a register map's
`values`, or a signal of a CAN frame. The driver tries the rules in their order, and before `codes`. A
rule holds if all its tests hold. The first rule that holds gives the state.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Final, NamedTuple, Protocol

import msgspec

from bridges.kinds.charger.signals import Activity, FaultSide
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.charger.state_codes import ROBOT_ERROR, STATION_ERROR, Codes, first_side
from drivers.json_fields import Value, same
from drivers.numbers import LongBit, bits_on

Read = Callable[[str], object]
"""A function that returns the value at a place. It raises DriverError if the place has no value."""
Meaning = tuple[Activity, FaultSide]
Found = list[tuple[FaultSide, str]]
"""A list of errors. Each error has its side (station or robot) and its text."""

MEANINGS: Final[Mapping[str, Meaning]] = {
    **{str(a): (a, "") for a in Activity if a is not Activity.UNKNOWN},
    "station_error": STATION_ERROR,
    "robot_error": ROBOT_ERROR,
}
UNKNOWN: Final[Meaning] = (Activity.UNKNOWN, "")


class Test(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A test of one value. The test holds if every condition that the YAML gives for it holds."""

    one_of: Annotated[list[Value], tells("the values that pass the test.")] = []
    above: Annotated[float | None, tells("the value must be greater than this number.")] = None
    below: Annotated[float | None, tells("the value must be less than this number.")] = None

    def problems(self) -> Remarks:
        """Yield a problem for a test without a condition, and for a test that no value passes."""
        if not self.one_of and self.above is None and self.below is None:
            yield (), "tests nothing: give one_of, above or below"
        if self.above is not None and self.below is not None and self.above >= self.below:
            yield ("below",), "must be greater than above"

    def holds(self, value: object) -> bool:
        """Does the value pass the test? For `above` and `below`, true counts as 1 and false as 0."""
        if self.one_of and not any(same(value, given) for given in self.one_of):
            return False
        if self.above is None and self.below is None:
            return True
        if not isinstance(value, int | float):
            return False
        over = self.above is None or value > self.above
        return over and (self.below is None or value < self.below)

    def text(self) -> str:
        """Return the conditions as text, for `check`."""
        parts = [f"one of {', '.join(map(str, self.one_of))}"] if self.one_of else []
        parts += [f"above {self.above:g}"] if self.above is not None else []
        parts += [f"below {self.below:g}"] if self.below is not None else []
        return " and ".join(parts)


class Rule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One rule. If the rule holds, `means` is the station's state."""

    means: Annotated[str, tells("the state: one of the keys of `codes`, such as `charging`.")]
    when: Annotated[
        dict[Name, Test],
        tells("place -> the test of its value. Without `when` the rule always holds."),
    ] = {}
    text: Annotated[Name | None, tells("the error's text, if `means` is an error.")] = None

    def problems(self) -> Remarks:
        """Yield a problem for an unknown meaning, and for a text on a state that is not an error."""
        if self.means not in MEANINGS:
            yield ("means",), f"is '{self.means}': write one of {', '.join(MEANINGS)}"
        elif self.text and MEANINGS[self.means][0] is not Activity.ERROR:
            yield ("text",), "is for an error"


class ErrorNumber(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An error that the station gives as one number. `check` and the status show a number that the YAML
    does not list as `error N`."""

    at: Annotated[Name, tells("the place of the number.")]
    well: Annotated[tuple[int, ...], tells("the numbers that mean no error.")] = (0,)
    station: Annotated[dict[int, Name], tells("number -> text, for faults of the station.")] = {}
    robot: Annotated[
        dict[int, Name],
        tells("number -> text, for faults of the robot, of its receiver or of its position."),
    ] = {}

    def problems(self) -> Remarks:
        """Yield a problem for each number with two meanings."""
        for number in self.station.keys() & self.robot.keys():
            yield ("robot", str(number)), f"{number} is already a fault of the station"
        for number in {*self.station, *self.robot}.intersection(self.well):
            yield ("well",), f"{number} is already an error"

    def errors(self, value: object) -> Found:
        """Return the error for this number. A number in `well` means no error."""
        if not isinstance(value, int | float) or value in self.well:
            return [] if isinstance(value, int | float) else [("", f"error {value}")]
        sides: tuple[tuple[FaultSide, Mapping[int, str]], ...] = (
            ("station", self.station),
            ("robot", self.robot),
        )
        known: Found = [(side, texts[int(value)]) for side, texts in sides if value in texts]
        return known or [("", f"error {value:g}")]


class ErrorBits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Errors that the station gives as bits of one number, such as a flag byte. `check` and the status
    show a bit that the YAML does not list as `error bit N`."""

    at: Annotated[Name, tells("the place of the number.")]
    ignore: Annotated[list[LongBit], tells("bits that mean no error.")] = []
    station: Annotated[
        dict[LongBit, Name], tells("bit (0: least significant) -> text, for faults of the station.")
    ] = {}
    robot: Annotated[
        dict[LongBit, Name],
        tells("bit -> text, for faults of the robot, of its receiver or of its position."),
    ] = {}

    def problems(self) -> Remarks:
        """Yield a problem for each bit with two meanings."""
        for bit in self.station.keys() & self.robot.keys():
            yield ("robot", str(bit)), f"bit {bit} is already a fault of the station"

    def errors(self, value: object) -> Found:
        """Return the errors of the set bits. The order is the station's errors, unlisted bits, the
        robot's errors."""
        if not isinstance(value, int | float) or value != int(value) or value < 0:
            return [("", f"error flags {value}")]
        on = [bit for bit in bits_on(int(value)) if bit not in self.ignore]
        known: Found = [("station", self.station[bit]) for bit in on if bit in self.station]
        known += [("", f"error bit {b}") for b in on if b not in {*self.station, *self.robot}]
        return known + [("robot", self.robot[bit]) for bit in on if bit in self.robot]


class StationErrors(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The values that report errors of the station, or of the robot at the station. These errors count
    in any state."""

    station: Annotated[
        dict[Name, Name],
        tells("place -> text. A value other than 0 means this fault of the station."),
    ] = {}
    robot: Annotated[
        dict[Name, Name],
        tells("""place -> text. A value other than 0 means this fault of the robot, of its receiver or
        of its position."""),
    ] = {}
    codes: Annotated[
        list[ErrorNumber], tells("errors that the station gives as one number each.")
    ] = []
    bits: Annotated[
        list[ErrorBits], tells("errors that the station gives as bits of a flag byte or word.")
    ] = []

    def found(self, read: Read) -> Found:
        """Return all present errors, the station's first. A value of None is unknown, and counts as no
        error."""
        sides: tuple[tuple[FaultSide, Mapping[str, str]], ...] = (
            ("station", self.station),
            ("robot", self.robot),
        )
        flags = [(side, t) for side, texts in sides for at, t in texts.items() if read(at)]
        numbers: Found = []
        for number in (*self.codes, *self.bits):
            assert isinstance(number, ErrorNumber | ErrorBits)
            if (value := read(number.at)) is not None:
                numbers += number.errors(value)
        order = ("station", "", "robot")
        return sorted([*flags, *numbers], key=lambda error: order.index(error[0]))

    def places(self) -> Iterator[tuple[tuple[str, ...], str]]:
        """Yield each value that this section of the YAML reads, as a pair of its path and its place.
        The path is relative to this section."""
        for side in ("station", "robot"):
            for at in getattr(self, side):
                yield (side, at), at
        for key in ("codes", "bits"):
            for n, number in enumerate(getattr(self, key)):
                yield (key, str(n), "at"), number.at


def places(rules: list[Rule]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield each value that the rules test, as a pair of its path and its place. The path is relative
    to `rules` in the YAML."""
    for n, rule in enumerate(rules):
        for at in rule.when:
            yield (str(n), "when", at), at


def judge(rules: list[Rule], read: Read) -> Rule | None:
    """Return the first rule that holds, or None."""
    return next((r for r in rules if all(t.holds(read(at)) for at, t in r.when.items())), None)


class JudgedState(msgspec.Struct, frozen=True):
    """The station's state, after the driver has applied rules, codes and errors.

    `activity` is ERROR whenever there is an error. `does` is the activity that the station would have
    without its errors. `side` is the side that is at fault (station or robot). `code` is the maker's
    state, which messages show. `text` holds the texts of the errors.
    """

    activity: Activity
    side: FaultSide
    code: int | str
    text: str
    does: Activity

    @property
    def charges(self) -> bool:
        """Return whether the station charges in spite of an error."""
        return self.activity is Activity.ERROR and self.does is Activity.CHARGING


def judged(
    station: "StateRules", read: Read, code: int | str | None, told: FaultSide = ""
) -> JudgedState:
    """Return the state that follows from rules, codes and errors. Raises DriverError.

    `code` is the maker's state, or None if the station has no codes. `told` is the side at fault
    (station or robot) according to the station's own error text. If one of `station.errors` is present,
    the state is an error.
    """
    meant = meaning(station.rules, station.codes, read, code)
    return with_errors(meant, station.errors.found(read), station.codes, told)


class Meant(NamedTuple):
    """The state that follows from rules and codes. Messages show `code`, which is the maker's state or
    the number of the rule. `text` is the text of the rule that holds."""

    activity: Activity
    side: FaultSide
    code: int | str
    text: str = ""


def meaning(rules: list[Rule], codes: Codes | None, read: Read, code: int | str | None) -> Meant:
    """Return the state that follows from rules and codes. Raises DriverError."""
    rule = judge(rules, read)
    if rule is not None:
        return Meant(*MEANINGS[rule.means], f"rule {rules.index(rule) + 1}", rule.text or "")
    if codes is not None and code is not None:
        return Meant(*codes.meanings().get(code, UNKNOWN), code)
    return Meant(*UNKNOWN, "of no rule")


def with_errors(
    meant: Meant, errors: Found, codes: Codes | None = None, told: FaultSide = ""
) -> JudgedState:
    """Combine the state with the errors. `told` is the side at fault (station or robot) according to
    the station's own error text."""
    wrong: Found = [(meant.side, meant.text), *errors] if meant.text else errors
    shown = Activity.ERROR if wrong else meant.activity
    side = first_side([meant.side, told, *(whose for whose, _ in wrong)])
    if codes is not None:
        side = side or codes.unnamed_side(meant.code)
    return JudgedState(shown, side, meant.code, said(wrong), meant.activity)


class StateRules(Protocol):
    """The part of a station's settings, or of its register map, that defines its state."""

    @property
    def codes(self) -> Codes | None:
        """The meanings of the maker's state numbers."""

    @property
    def rules(self) -> list[Rule]:
        """The rules. The driver tries them before the codes."""

    @property
    def errors(self) -> StationErrors:
        """The values that mean an error in any state."""


def rows(rules: list[Rule], errors: StationErrors) -> Iterator[tuple[str, str]]:
    """Yield the rows for `check`."""
    for n, rule in enumerate(rules):
        tests = (f"{at} {test.text()}" for at, test in rule.when.items())
        text = f": {rule.text}" if rule.text else ""
        yield f"rule {n + 1}", f"{' and '.join(tests) or 'else'} is {rule.means}{text}"
    for side in ("station", "robot"):
        for at, text in getattr(errors, side).items():
            yield f"{side}'s error", f"{at} not 0: {text}"
        for kind, numbers in (("", errors.codes), ("bit ", errors.bits)):
            for number in numbers:
                for value, text in getattr(number, side).items():
                    yield f"{side}'s error", f"{number.at} {kind}{value}: {text}"


def problems(rules: list[Rule], has_codes: bool) -> Remarks:
    """Yield a problem for rules that the driver never reaches. Yield a problem if rules and codes
    cannot give the state. Each path is relative to the station's section of the YAML."""
    if not rules and not has_codes:
        yield (
            ("codes",),
            "is missing: give the meanings of the maker's state numbers here, or give rules",
        )
    for n, rule in enumerate(rules[:-1]):
        if not rule.when:
            yield (
                ("rules", str(n)),
                f"rule {n + 1} always holds: the rules after it are never tried",
            )
            return
    means = {rule.means for rule in rules}
    if rules and not has_codes and not {"idle", "charging"} <= means:
        yield ("rules",), "needs a rule for idle and a rule for charging"


def said(found: Found) -> str:
    """Return the texts of all errors in one line."""
    return "; ".join(text for _, text in found)


def receiver_text(number: float | None) -> str | None:
    """Return a receiver's id as text. The id 0 means no receiver and gives "". Return None if the map
    has no receiver's id."""
    return None if number is None else str(int(number)) if number else ""

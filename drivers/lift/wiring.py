"""A lift's wiring in the YAML. The YAML gives every signal, because sites differ in every signal."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

import msgspec

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Hazard
from bridges.kinds.shared.fields import Name, tells
from drivers.hal.points import Input, Output
from drivers.lift import codes
from drivers.lift.codes import Encoding

Number = Annotated[int, msgspec.Meta(ge=0, le=65535)]
"""A number that a controller shows on several lines."""


class LiftInput(Input, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One line from the lift."""

    valid_when: Annotated[
        Literal["agv_mode"] | None,
        tells("""`agv_mode` if the line is valid only while AGV mode is on. Outside AGV mode
        a floor or motion line reads as unknown, a door line as neither open nor closed, and a
        hazard line as clear."""),
    ] = None


class DoorInput(LiftInput, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The contact of a door that has only one contact."""

    proves: Annotated[
        Literal["open", "closed"],
        tells("""the end position that the asserted contact proves. `door_travel_s` estimates when the
        door is at the other end position."""),
    ]


class ParityInput(LiftInput, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A parity line. It reveals a broken line of the code."""

    total: Annotated[
        Literal["even", "odd"],
        tells("""whether the number of asserted lines is even or odd. The parity line
        counts too."""),
    ]


class MotionCode(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The car's motion as a number on several lines."""

    bits: Annotated[list[LiftInput], tells("the number's lines, least significant first.")]
    codes: Annotated[
        dict[Number, Literal["stopped", "up", "down", "moving"]],
        tells("number -> motion; an unlisted number is a fault."),
    ]


ServiceState = Literal[
    "normal",
    "agv_mode",
    "fire_alarm",
    "code_blue",
    "earthquake",
    "emergency",
    "out_of_service",
    "manual_mode",
    "overload",
    "fault",
]


class ServiceCode(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The lift's service state as a number on several lines."""

    bits: Annotated[list[LiftInput], tells("the number's lines, least significant first.")]
    codes: Annotated[
        dict[Number, ServiceState],
        tells("""number -> state. List every number. Write `fault` for a number that the controller
        never shows. Such a number means that a line is broken, and takes the lift out of service."""),
    ]

    def means(self, number: int) -> str:
        """Return the state for a number."""
        state = self.codes[number]
        return Hazard.OUT_OF_SERVICE if state == "fault" else state


class LiftInputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The lines from the lift.

    A hazard takes the lift away from RMF at once. A door has one contact or two. Give the motion in one
    of these ways: `moving`, `stopped`, `up` together with `down`, or a code.
    """

    fire_alarm: Annotated[
        LiftInput | None,
        tells("the fire alarm; sets MODE_FIRE, which is latched with `fire_reset: manual`."),
    ] = None
    code_blue: Annotated[
        LiftInput | None, tells("the hospital's code blue; sets MODE_EMERGENCY.")
    ] = None
    earthquake: Annotated[LiftInput | None, tells("an earthquake sensor; sets MODE_EMERGENCY.")] = (
        None
    )
    emergency: Annotated[
        LiftInput | None, tells("the car's emergency stop; sets MODE_EMERGENCY.")
    ] = None
    out_of_service: Annotated[
        LiftInput | None, tells("the lift is off or out of order; sets MODE_OFFLINE.")
    ] = None
    manual_mode: Annotated[
        LiftInput | None, tells("inspection or manual drive (key switch); sets MODE_OFFLINE.")
    ] = None
    overload: Annotated[LiftInput | None, tells("the car is too heavy; delays the ride.")] = None
    agv_mode: Annotated[
        LiftInput | None,
        tells("the controller confirms AGV mode; not needed if `service` shows AGV mode."),
    ] = None
    service: Annotated[ServiceCode | None, tells("the lift's service state as a code.")] = None
    door: Annotated[DoorInput | None, tells("the door's only contact.")] = None
    door_opened: Annotated[
        LiftInput | None, tells("the car's door is open; needs `door_closed` as well.")
    ] = None
    door_closed: Annotated[
        LiftInput | None, tells("the car's door is closed; needs `door_opened` as well.")
    ] = None
    rear_door: Annotated[DoorInput | None, tells("the rear door's only contact.")] = None
    rear_door_opened: Annotated[
        LiftInput | None, tells("the rear door is open; needs `rear_door_closed` as well.")
    ] = None
    rear_door_closed: Annotated[
        LiftInput | None, tells("the rear door is closed; needs `rear_door_opened` as well.")
    ] = None
    moving: Annotated[LiftInput | None, tells("the car moves, up or down.")] = None
    stopped: Annotated[LiftInput | None, tells("the car stands.")] = None
    up: Annotated[
        LiftInput | None,
        tells("the car moves up. The car stands while neither `up` nor `down` is on."),
    ] = None
    down: Annotated[
        LiftInput | None,
        tells("the car moves down. The car stands while neither `up` nor `down` is on."),
    ] = None
    motion: Annotated[MotionCode | None, tells("motion as a code.")] = None


class FloorCode(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The car's position as a code on several lines."""

    encoding: Annotated[
        Literal["binary", "gray", "bcd", "one_hot"],
        tells("how the lines show the landing. With `one_hot` each landing has a line."),
    ]
    bits: Annotated[list[LiftInput], tells("the number's lines, least significant first.")] = []
    codes: Annotated[dict[Number, Name], tells("number -> landing.")] = {}
    parity: Annotated[ParityInput | None, tells("a line that reveals a broken line.")] = None
    lines: Annotated[
        dict[Name, LiftInput],
        tells("landing -> its line, with `one_hot`. Between floors no line is asserted."),
    ] = {}
    between_floors: Annotated[
        list[Number],
        tells("the numbers for a car between floors. Any other unlisted number is a fault."),
    ] = msgspec.field(default_factory=lambda: [0])

    def inputs(self) -> Iterator[tuple[str, tuple[str, ...], LiftInput]]:
        """Yield (signal, path, line) for each line. The path begins below this section of the YAML."""
        for i, bit in enumerate(self.bits):
            yield f"floor_bit{i}", ("bits", str(i)), bit
        for level, line in self.lines.items():
            yield f"floor_{level}", ("lines", level), line
        if self.parity:
            yield "floor_parity", ("parity",), self.parity

    def read(self, shown: Mapping[str, bool]) -> tuple[str | None, str]:
        """Return the landing and the code's fault. The landing is None between floors. The fault is ""
        for a valid code."""
        if self.encoding == "one_hot":
            on = [level for level in self.lines if shown[f"floor_{level}"]]
            if len(on) > 1:
                return None, f"the lines of {' and '.join(on)} are on at once"
            return (on[0] if on else None), ""
        lines = [shown[f"floor_bit{i}"] for i in range(len(self.bits))]
        if self.parity and (sum(lines) + shown["floor_parity"]) % 2 != (self.parity.total == "odd"):
            return None, f"parity is not {self.parity.total}: a line is broken"
        number = codes.decode(self.encoding, lines)
        if number is None:
            return None, "a BCD digit above 9"
        if number in self.codes:
            return self.codes[number], ""
        return None, "" if number in self.between_floors else f"code {number} is no floor's code"

    def show(self, level: str | None) -> dict[str, bool]:
        """Return the signals of the floor code while the car is at `level`. True means asserted. A
        `level` of None means between floors. Raises ValueError if `level` has no code."""
        for _, shown_level, shown in self.shows():
            if shown_level == level:
                return shown
        raise ValueError(f"no code for {level or 'between floors'}")

    def shows(self) -> Iterator[tuple[int | None, str | None, dict[str, bool]]]:
        """Yield (number, landing, lines) for each code that the controller shows. The landing is None
        between floors.

        With `one_hot` the number is None. Raises ValueError for a number that does not fit on the
        lines.
        """
        if self.encoding == "one_hot":
            for level in (None, *self.lines):
                yield None, level, {f"floor_{name}": name == level for name in self.lines}
            return
        for number in self.between_floors:
            yield number, None, self._lines(self.encoding, number)
        for number, level in self.codes.items():
            yield number, level, self._lines(self.encoding, number)

    def _lines(self, encoding: Encoding, number: int) -> dict[str, bool]:
        lines = codes.encode(encoding, number, len(self.bits))
        shown = {f"floor_bit{i}": on for i, on in enumerate(lines)}
        if self.parity:
            shown["floor_parity"] = sum(lines) % 2 != (self.parity.total == "odd")
        return shown


class CallCode(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Calls as a binary number on several lines. The number 0 means no call."""

    bits: Annotated[list[Output], tells("the number's lines, least significant first.")]
    codes: Annotated[dict[Number, Name], tells("number -> landing.")]

    def lines(self, level: str | None) -> dict[str, bool]:
        """Return the signals of the call code for a call to `level`. True means asserted. A `level` of
        None means no call."""
        number = next((n for n, name in self.codes.items() if name == level), 0)
        return codes.lines("call", number, len(self.bits))


class LiftOutputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The lines to the lift, except calls. A line stays on as long as its command lasts. The safe state
    of each line is off."""

    agv_mode_request: Annotated[
        Output | None, tells("requests AGV mode while a robot holds the lift.")
    ] = None
    door_open: Annotated[
        Output | None, tells("holds the door open at the landing where the car stands.")
    ] = None
    rear_door_open: Annotated[
        Output | None, tells("holds the rear door open at the landing where the car stands.")
    ] = None


class LiftWiring(LiftSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A lift on dry contacts, which are GPIO pins or points of a Modbus I/O module."""

    inputs: Annotated[LiftInputWiring, tells("the lines from the lift.")]
    floor_code: Annotated[FloorCode, tells("the car's position.")]
    outputs: Annotated[LiftOutputWiring, tells("the lines to the lift, except calls.")]
    calls: Annotated[
        dict[Name, Output], tells("landing -> its line. Give either `calls` or `call_code`.")
    ] = msgspec.field(default_factory=dict)
    call_code: Annotated[CallCode | None, tells("calls as a number on several lines.")] = None

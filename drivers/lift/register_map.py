"""The register map of a lift's gateway in the YAML: places, and meanings of the numbers."""

import functools
import operator
from collections.abc import Collection, Iterator
from typing import Annotated, Final, Literal, TypeAlias

import msgspec

from bridges.kinds.lift.signals import Hazard
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.modbus.map_parts import InRegister, Placed, WrittenLevels, WrittenPlace
from drivers.hal.modbus.registers import REGISTERS, Place, Word
from drivers.lift.wiring import ServiceState
from drivers.numbers import Bit


class NumberField(InRegister, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A number in a register."""

    bits: Annotated[
        list[Bit], tells("the bits, least significant first; the whole register when absent.")
    ] = msgspec.field(default_factory=list)
    valid_when: Annotated[
        Literal["agv_mode"] | None, tells("`agv_mode` if it is valid only while AGV mode is on.")
    ] = None

    def number(self, word: int) -> int:
        """Extract the number from a register's value."""
        if not self.bits:
            return word
        return sum((word >> bit & 1) << i for i, bit in enumerate(self.bits))

    def word(self, number: int) -> int:
        """Return the register's value for a number."""
        if not self.bits:
            return number
        return sum((number >> i & 1) << bit for i, bit in enumerate(self.bits))

    def fits(self, numbers: Collection[int], key: str) -> Remarks:
        """Yield problems: an invalid place, a bit listed twice, numbers of `key` that do not fit."""
        yield from InRegister.problems(self)
        if len(set(self.bits)) < len(self.bits):
            yield ("bits",), "a bit is listed twice"
        for number in numbers:
            if self.bits and number >> len(self.bits):
                yield (key, str(number)), f"{number} does not fit on {len(self.bits)} bits"


class FloorField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The car's position."""

    codes: Annotated[dict[Word, Name], tells("number -> landing; an unlisted number is a fault.")]
    between_floors: Annotated[list[Word], tells("the numbers for a car between floors.")] = (
        msgspec.field(default_factory=list)
    )

    def problems(self) -> Remarks:
        """Yield problems: those of `fits`; a number with two meanings."""
        yield from self.fits([*self.codes, *self.between_floors], "codes")
        for number in self.codes:
            if number in self.between_floors:
                yield ("codes", str(number)), f"{number} means between floors as well"


class DoorField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A door."""

    codes: Annotated[
        dict[Word, Literal["open", "closed", "moving"]],
        tells("number -> state; an unlisted number is a fault."),
    ]

    def problems(self) -> Remarks:
        """Yield problems: those of `fits`; a door without a code for open or for closed."""
        yield from self.fits(self.codes, "codes")
        if not {"open", "closed"} <= set(self.codes.values()):
            yield ("codes",), "needs a code for open and one for closed"


class MotionField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The car's motion."""

    codes: Annotated[
        dict[Word, Literal["stopped", "up", "down", "moving"]],
        tells("number -> motion; an unlisted number is a fault."),
    ]

    def problems(self) -> Remarks:
        """Yield problems: those of `fits`; no code for standing, or no code for moving."""
        yield from self.fits(self.codes, "codes")
        shown = set(self.codes.values())
        if "stopped" not in shown or not ("moving" in shown or {"up", "down"} <= shown):
            yield ("codes",), "needs a code for stopped, and for moving or up and down"


class ServiceField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The lift's service state."""

    codes: Annotated[
        dict[Word, ServiceState],
        tells("number -> state; at an unlisted number the lift is out of service."),
    ]

    def problems(self) -> Remarks:
        """Yield the problems of `fits`."""
        yield from self.fits(self.codes, "codes")

    def means(self, number: int) -> str:
        """Return the state for a number."""
        state = self.codes.get(number, "fault")
        return Hazard.OUT_OF_SERVICE if state == "fault" else state


Number: TypeAlias = FloorField | DoorField | MotionField | ServiceField


class LiftFlag(Placed, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A flag: one bit."""

    bit: Annotated[Bit | None, tells("the bit's number; 0 is the least significant.")] = None
    active: Annotated[Literal["high", "low"], tells("the asserted level; `high` is 1.")]
    valid_when: Annotated[
        Literal["agv_mode"] | None, tells("`agv_mode` if it is valid only while AGV mode is on.")
    ] = None

    def asserted(self, word: int) -> bool:
        """Is the flag asserted, by the value of its register or bit?"""
        return bool(word >> (self.bit or 0) & 1) == (self.active == "high")

    def word(self, asserted: bool) -> int:
        """Return the value of the flag's register or bit for an asserted or clear flag."""
        return (asserted == (self.active == "high")) << (self.bit or 0)

    def problems(self) -> Remarks:
        """Yield problems: an invalid place; a register without a bit; a coil with a bit."""
        yield from super().problems()
        if self.is_in(*REGISTERS) and self.bit is None:
            yield ("bit",), "a flag is one bit of a register: say which"
        if self.is_in("coil", "discrete input") and self.bit is not None:
            yield ("bit",), "is for registers: a coil or discrete input is one bit already"


READ_BACK: Final = tells("""`read_back` for this command alone. `false` also suits a gateway that takes
    a call and then clears the call's place by itself.""")


class LiftCommand(WrittenLevels, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One request to the lift."""

    ON = "ask"
    OFF = "release"

    at: Annotated[
        Place,
        tells("""`coil N` or `holding register N`. Commands may share a register: their values are
        joined, bit by bit."""),
    ]
    ask: Annotated[Word, tells("the value of the request.")] = 1
    release: Annotated[Word, tells("the value for no request, its safe value.")] = 0
    read_back: Annotated[bool | None, READ_BACK] = None


class CallCommand(WrittenPlace, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Calls as numbers in a register."""

    TABLES = ("holding register",)

    at: Annotated[Place, tells("`holding register N`.")]
    codes: Annotated[dict[Word, Name], tells("number -> landing.")]
    none: Annotated[Word, tells("the value for no call.")] = 0
    read_back: Annotated[bool | None, READ_BACK] = None

    def problems(self) -> Remarks:
        """Yield problems: a place that cannot be written; a landing with the number of no call."""
        yield from super().problems()
        if self.none in self.codes:
            yield ("codes", str(self.none)), f"{self.none} is the number for no call (none)"


class Commands(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The commands to the lift."""

    agv_mode_request: Annotated[
        LiftCommand | None, tells("requests AGV mode while a robot holds the lift.")
    ] = None
    door_open: Annotated[
        LiftCommand | None, tells("holds the door open at the landing where the car stands.")
    ] = None
    rear_door_open: Annotated[
        LiftCommand | None, tells("holds the rear door open at the landing where the car stands.")
    ] = None
    calls: Annotated[
        dict[Name, LiftCommand], tells("landing -> its command. Give either `calls` or `call`.")
    ] = {}
    call: Annotated[CallCommand | None, tells("calls as numbers in one register.")] = None
    read_back: Annotated[
        bool,
        tells("""false where commands can only be written; then every scan writes them, and nothing
        proves that the gateway accepted them."""),
    ] = True

    def singles(self) -> Iterator[tuple[str, tuple[str, ...], LiftCommand]]:
        """Yield each command except `call`: its signal, its path below this section, the command."""
        for name in ("agv_mode_request", "door_open", "rear_door_open"):
            command: LiftCommand | None = getattr(self, name)
            if command:
                yield name, (name,), command
        for level, command in self.calls.items():
            yield f"call_{level}", ("calls", level), command

    def places(self) -> Iterator[tuple[tuple[str, ...], str, int]]:
        """Yield each command's path below this section, its place, and the bits it uses there."""
        for _, path, command in self.singles():
            yield path, command.at, command.ask | command.release
        if self.call:
            bits = functools.reduce(operator.or_, self.call.codes, self.call.none)
            yield ("call",), self.call.at, bits

    def calling(self) -> dict[str, int]:
        """Return place -> the bits of calls there."""
        found: dict[str, int] = {}
        for path, where, bits in self.places():
            if path[0] in ("calls", "call"):
                found[where] = found.get(where, 0) | bits
        return found

    def unread(self) -> set[str]:
        """Return the places that are never read back."""
        return {where for where, read_back in self._read_back().items() if False in read_back}

    def _read_back(self) -> dict[str, dict[bool, tuple[str, ...]]]:
        """Return place -> `read_back` of its commands -> the path of the last such command."""
        found: dict[str, dict[bool, tuple[str, ...]]] = {}
        every = [(path, command) for _, path, command in self.singles()]
        for path, command in [*every, *([(("call",), self.call)] if self.call else [])]:
            own = self.read_back if command.read_back is None else command.read_back
            found.setdefault(command.at, {})[own] = path
        return found

    def words(self, asserted: Collection[str], call: str | None) -> dict[str, int]:
        """Return place -> value for these asserted signals and this landing's call (None: no call)."""
        found: dict[str, int] = {}
        for signal, _, command in self.singles():
            found[command.at] = found.get(command.at, 0) | command.value(signal in asserted)
        if self.call:
            codes = {level: number for number, level in self.call.codes.items()}
            value = self.call.none if call is None else codes[call]
            found[self.call.at] = found.get(self.call.at, 0) | value
        return found

    def problems(self) -> Remarks:
        """Yield problems: both `calls` and `call`; commands that use the same bit of a register."""
        if self.calls and self.call:
            yield ("calls",), "calls and call are two ways of calling: delete one of the two"
        for where, told in self._read_back().items():
            if len(told) > 1:
                text = (
                    f"is another than for the other commands at {where}, which is read as a whole"
                )
                yield (*told[False], "read_back"), text
        taken: dict[str, int] = {}
        owners: dict[str, list[str]] = {}
        values = [(p, c.at, {"ask": c.ask, "release": c.release}) for _, p, c in self.singles()]
        values += [
            (path, at, {"at": bits}) for path, at, bits in self.places() if path == ("call",)
        ]
        for path, at, words in values:
            for key, bits in words.items():
                if bits & taken.get(at, 0):
                    others = " and ".join(owners[at])
                    text = f"{'.'.join(path)} shares bits of {at} with {others}"
                    yield (*path, key), f"{text}: give each command bits of its own"
            owners.setdefault(at, []).append(".".join(path))
            taken[at] = functools.reduce(operator.or_, words.values(), taken.get(at, 0))


class LiftMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The gateway's register map. Addresses begin at 0."""

    floor: Annotated[FloorField, tells("the car's position.")]
    door: Annotated[DoorField, tells("the car's door.")]
    rear_door: Annotated[DoorField | None, tells("the car's rear door.")] = None
    motion: Annotated[MotionField | None, tells("the car's motion.")] = None
    service: Annotated[
        ServiceField | None, tells("the lift's service state; it may include hazards and AGV mode.")
    ] = None
    agv_mode: Annotated[
        LiftFlag | None, tells("the controller confirms AGV mode; not needed if `service` does.")
    ] = None
    fire_alarm: Annotated[
        LiftFlag | None, tells("the fire alarm; MODE_FIRE, latched with `fire_reset: manual`.")
    ] = None
    code_blue: Annotated[LiftFlag | None, tells("the hospital's code blue; MODE_EMERGENCY.")] = None
    earthquake: Annotated[LiftFlag | None, tells("an earthquake sensor; MODE_EMERGENCY.")] = None
    emergency: Annotated[LiftFlag | None, tells("the car's emergency stop; MODE_EMERGENCY.")] = None
    out_of_service: Annotated[
        LiftFlag | None, tells("the lift is off or out of order; MODE_OFFLINE.")
    ] = None
    manual_mode: Annotated[
        LiftFlag | None, tells("inspection or manual drive (key switch); MODE_OFFLINE.")
    ] = None
    overload: Annotated[LiftFlag | None, tells("the car is too heavy; delays the ride.")] = None
    commands: Annotated[Commands, tells("the commands to the lift.")]

    def parts(self) -> dict[str, Number | LiftFlag]:
        """Return name -> part, for each given part that is read."""
        read = [name for name in self.__struct_fields__ if name != "commands"]
        found = {name: getattr(self, name) for name in read}
        return {name: part for name, part in found.items() if part is not None}

    def shows(self, state: str) -> bool:
        """Does the map have this state, as a flag or as a state of `service`?"""
        in_service = self.service is not None and state in self.service.codes.values()
        return in_service or getattr(self, state) is not None

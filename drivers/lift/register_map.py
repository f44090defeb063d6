"""The register map of a lift's gateway in the YAML. The map gives the place of each value, which is a
register or a coil. The map also gives the meaning of each number."""

import functools
import operator
from collections.abc import Collection, Iterator
from typing import Annotated, Final

import msgspec

from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.modbus.map_parts import WrittenLevels, WrittenPlace
from drivers.hal.modbus.registers import Place, Unit, Word
from drivers.lift import codes
from drivers.lift.register_parts import (
    UNIT,
    DoorField,
    FloorField,
    LiftFlag,
    MotionField,
    Number,
    ServiceField,
    place_of,
)

READ_BACK: Final = tells("""`read_back` for this command alone. Also write `false` if the gateway
accepts a call and then clears the call's register or coil by itself.""")


class LiftCommand(WrittenLevels, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One request to the lift."""

    ON = "ask"
    OFF = "release"

    at: Annotated[
        Place,
        tells("""`coil N` or `holding register N`. Commands may share a register. Their values are
        then joined, bit by bit."""),
    ]
    ask: Annotated[Word, tells("the value of the request.")] = 1
    release: Annotated[Word, tells("the safe value, which means no request.")] = 0
    read_back: Annotated[bool | None, READ_BACK] = None
    unit: Annotated[Unit | None, UNIT] = None


class CallCommand(WrittenPlace, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The command that calls the car. The register's number tells the landing."""

    TABLES = ("holding register",)

    at: Annotated[Place, tells("`holding register N`.")]
    codes: Annotated[dict[Word, Name], tells("number -> landing.")]
    none: Annotated[Word, tells("the value for no call.")] = 0
    read_back: Annotated[bool | None, READ_BACK] = None
    unit: Annotated[Unit | None, UNIT] = None

    def problems(self) -> Remarks:
        """Yield a problem for a place that cannot be written. Yield a problem for a landing whose
        number means "no call", and for a landing with two numbers."""
        yield from super().problems()
        if self.none in self.codes:
            yield ("codes", str(self.none)), f"{self.none} means no call already (none)"
        for number, text in codes.called_twice(self.codes):
            yield ("codes", str(number)), text


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
        tells("""false if commands cannot be read back. Then every scan writes the commands, and
        nothing proves that the gateway accepted them."""),
    ] = True

    def singles(self) -> Iterator[tuple[str, tuple[str, ...], LiftCommand]]:
        """Yield (signal, path, command) for each command except `call`. The path begins below this
        section of the YAML."""
        for name in ("agv_mode_request", "door_open", "rear_door_open"):
            command: LiftCommand | None = getattr(self, name)
            if command:
                yield name, (name,), command
        for level, command in self.calls.items():
            yield f"call_{level}", ("calls", level), command

    def places(self) -> Iterator[tuple[tuple[str, ...], str, int]]:
        """Yield (path, place, bits) for each command. `bits` are the bits that the command uses at its
        place."""
        for _, path, command in self.singles():
            yield path, place_of(command), command.ask | command.release
        if self.call:
            bits = functools.reduce(operator.or_, self.call.codes, self.call.none)
            yield ("call",), place_of(self.call), bits

    def calling(self) -> dict[str, int]:
        """Return the bits that the lift's calls use at each place."""
        found: dict[str, int] = {}
        for path, place, bits in self.places():
            if path[0] in ("calls", "call"):
                found[place] = found.get(place, 0) | bits
        return found

    def unread(self) -> set[str]:
        """Return the places that the driver never reads back."""
        return {place for place, read_back in self._read_back().items() if False in read_back}

    def _read_back(self) -> dict[str, dict[bool, tuple[str, ...]]]:
        """Return the values of `read_back` at each place. Commands that share a place may have
        different values. Each value comes with the path of the last command that has this value."""
        found: dict[str, dict[bool, tuple[str, ...]]] = {}
        every: list[tuple[tuple[str, ...], LiftCommand | CallCommand]] = [
            (path, command) for _, path, command in self.singles()
        ]
        if self.call:
            every.append((("call",), self.call))
        for path, command in every:
            own = self.read_back if command.read_back is None else command.read_back
            found.setdefault(place_of(command), {})[own] = path
        return found

    def words(self, asserted: Collection[str], call: str | None) -> dict[str, int]:
        """Return the value to write to each place. `asserted` are the signals that are on. `call` is
        the called landing, or None without a call."""
        found: dict[str, int] = {}
        for signal, _, command in self.singles():
            at = place_of(command)
            found[at] = found.get(at, 0) | command.value(signal in asserted)
        if self.call:
            numbers = {level: number for number, level in self.call.codes.items()}
            value = self.call.none if call is None else numbers[call]
            found[place_of(self.call)] = found.get(place_of(self.call), 0) | value
        return found

    def problems(self) -> Remarks:
        """Yield a problem if the YAML gives both `calls` and `call`. Yield a problem if commands use
        the same bit of a register."""
        if self.calls and self.call:
            yield ("calls",), "calls and call are two ways of calling: delete one of the two"
        for at, told in self._read_back().items():
            if len(told) > 1:
                text = (
                    f"differs from read_back of other commands at {at}, but the daemon can only"
                    " read the whole place back"
                )
                yield (*told[False], "read_back"), text
        taken: dict[str, int] = {}
        owners: dict[str, list[str]] = {}
        values = [
            (p, place_of(c), {"ask": c.ask, "release": c.release}) for _, p, c in self.singles()
        ]
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
    """The gateway's register map. Addresses begin at 0.

    A door is either a number or the flags of contacts. The motion is a number or flags too. Give the
    motion in one of these ways: `motion`, `moving`, `stopped`, or `up` together with `down`.
    """

    floor: Annotated[FloorField, tells("the car's position.")]
    door: Annotated[
        DoorField | None, tells("the car's door as a number, if the map has no `door_opened`.")
    ] = None
    door_opened: Annotated[
        LiftFlag | None, tells("the car's door is open; needs `door_closed` as well.")
    ] = None
    door_closed: Annotated[
        LiftFlag | None, tells("the car's door is closed; needs `door_opened` as well.")
    ] = None
    rear_door: Annotated[DoorField | None, tells("the car's rear door as a number.")] = None
    rear_door_opened: Annotated[
        LiftFlag | None, tells("the rear door is open; needs `rear_door_closed` as well.")
    ] = None
    rear_door_closed: Annotated[
        LiftFlag | None, tells("the rear door is closed; needs `rear_door_opened` as well.")
    ] = None
    motion: Annotated[MotionField | None, tells("the car's motion as a number.")] = None
    moving: Annotated[LiftFlag | None, tells("the car moves, up or down.")] = None
    stopped: Annotated[LiftFlag | None, tells("the car stands.")] = None
    up: Annotated[
        LiftFlag | None,
        tells("the car moves up. The car stands while neither `up` nor `down` is on."),
    ] = None
    down: Annotated[
        LiftFlag | None,
        tells("the car moves down. The car stands while neither `up` nor `down` is on."),
    ] = None
    service: Annotated[
        ServiceField | None, tells("the lift's service state; it may include hazards and AGV mode.")
    ] = None
    agv_mode: Annotated[
        LiftFlag | None,
        tells("the controller confirms AGV mode; not needed if `service` shows AGV mode."),
    ] = None
    fire_alarm: Annotated[
        LiftFlag | None,
        tells("the fire alarm; sets MODE_FIRE, which is latched with `fire_reset: manual`."),
    ] = None
    code_blue: Annotated[
        LiftFlag | None, tells("the hospital's code blue; sets MODE_EMERGENCY.")
    ] = None
    earthquake: Annotated[LiftFlag | None, tells("an earthquake sensor; sets MODE_EMERGENCY.")] = (
        None
    )
    emergency: Annotated[
        LiftFlag | None, tells("the car's emergency stop; sets MODE_EMERGENCY.")
    ] = None
    out_of_service: Annotated[
        LiftFlag | None, tells("the lift is off or out of order; sets MODE_OFFLINE.")
    ] = None
    manual_mode: Annotated[
        LiftFlag | None, tells("inspection or manual drive (key switch); sets MODE_OFFLINE.")
    ] = None
    overload: Annotated[LiftFlag | None, tells("the car is too heavy; delays the ride.")] = None
    commands: Annotated[Commands, tells("the commands to the lift.")]

    def problems(self) -> Remarks:
        """Yield a problem for a door or motion that is incomplete, or that is given in two ways."""
        for door in ("door", "rear_door"):
            ends = [name for name in (f"{door}_opened", f"{door}_closed") if getattr(self, name)]
            if len(ends) == 1:
                yield (ends[0],), f"needs both {door}_opened and {door}_closed"
            elif ends and getattr(self, door):
                yield (
                    (ends[0],),
                    f"{door} and its contacts both give the door: delete one of the two",
                )
        if not (self.door or self.door_opened or self.door_closed):
            yield (), "needs the door: write door, or door_opened and door_closed"
        if bool(self.up) != bool(self.down):
            yield ("up" if self.up else "down",), "up and down belong together: write both"
        ways = [name for name in ("motion", "moving", "stopped", "up") if getattr(self, name)]
        if len(ways) > 1:
            yield (ways[1],), f"{' and '.join(ways)} give the motion in several ways: keep one"

    def parts(self) -> dict[str, Number | LiftFlag]:
        """Return each part that the driver reads, by its name."""
        read = [name for name in self.__struct_fields__ if name != "commands"]
        found = {name: getattr(self, name) for name in read}
        return {name: part for name, part in found.items() if part is not None}

    def flag(self, name: str) -> LiftFlag | None:
        """Return the flag of this name. Return None if the map does not give it."""
        part = getattr(self, name, None)
        return part if isinstance(part, LiftFlag) else None

    def shows(self, state: str) -> bool:
        """Return whether the map has this state, as a flag or as a state of `service`."""
        in_service = self.service is not None and state in self.service.codes.values()
        return in_service or getattr(self, state) is not None

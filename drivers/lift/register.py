"""A lift behind the Modbus registers of a gateway.

Floor, door, motion and service state are numbers. Hazards are bits. Commands are registers or coils. A
number that the map does not list is a fault. Such a number never means a floor, an open door or a
standing car.
"""

from collections.abc import Iterator, Mapping, Set
from typing import Annotated, Final

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion, Side
from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.driver_type import DriverType
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus.lines import ModbusLines
from drivers.hal.modbus.registers import TABLES, WRITABLE, Unit, misplaced
from drivers.hal.points import Clearing
from drivers.lift import checks
from drivers.lift.dry_contact import DOOR as BY_CONTACTS
from drivers.lift.dry_contact import UP_DOWN
from drivers.lift.register_map import LiftMap
from drivers.lift.register_parts import (
    DoorField,
    FloorField,
    LiftFlag,
    MotionField,
    Number,
    apart,
    place_of,
    point_at,
)
from drivers.lift.table import DEBOUNCE_S, HAZARD_DEBOUNCE_S, MOTION
from drivers.lift.tables import BETWEEN, FAULT, floors, how_long

DOOR: Final = {
    "open": DoorReading.OPEN,
    "closed": DoorReading.CLOSED,
    "moving": DoorReading.BETWEEN,
}
NUMBERS: Final = ("means", "number", "register reads")
HOLD: Final = {Side.FRONT: "door_open", Side.REAR: "rear_door_open"}


class RegisterLiftSettings(LiftSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A lift and its gateway's registers."""

    unit: Annotated[Unit, tells("the gateway's Modbus unit id.")]
    map: Annotated[LiftMap, tells("the gateway's register map.")]

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        levels, commands = self.levels(), self.map.commands
        yield from checks.floors(self)
        yield from checks.alarm(self)
        landings = set(self.map.floor.codes.values())
        yield from checks.named("code", ("map", "floor", "codes"), landings, levels)
        if commands.call:
            called = set(commands.call.codes.values())
            yield from checks.named("code", ("map", "commands", "call", "codes"), called, levels)
        else:
            yield from checks.named("call", ("map", "commands", "calls"), commands.calls, levels)
        yield from _rear_door(self)
        told, asks = self.map.shows("agv_mode"), bool(commands.agv_mode_request)
        yield from checks.by_call(self, told, asks, ("map", "commands", "agv_mode_request"))
        for name, part in self.map.parts().items():
            if part.valid_when and not told:
                yield (
                    ("map", name),
                    "valid_when: agv_mode needs the flag agv_mode, or the state agv_mode of service",
                )
            elif part.valid_when and name in ("agv_mode", "service"):
                yield ("map", name), f"{name} itself shows AGV mode: delete valid_when"
        if self.accept_unsafe:
            yield (
                ("accept_unsafe",),
                "a map has no wires that could be unsafe: delete accept_unsafe",
            )


def _rear_door(settings: RegisterLiftSettings) -> Remarks:
    rear = any(stop.side is Side.REAR for stop in settings.stops().values())
    found = settings.map
    has_rear = bool(found.rear_door or found.rear_door_opened)
    if rear and not has_rear:
        yield ("map",), "no rear_door, but some floors have side: rear"
    if has_rear and not rear:
        path = "rear_door" if found.rear_door else "rear_door_opened"
        yield ("map", path), "no floor has side: rear"
    if rear and found.commands.door_open and not found.commands.rear_door_open:
        yield ("map", "commands"), "no rear_door_open, but some floors have side: rear"


def warnings(settings: RegisterLiftSettings) -> Remarks:
    """Yield a warning, with its path below the device, for each valid setting that may be a mistake."""
    found, commands = settings.map, settings.map.commands
    fire, told = found.shows(Hazard.FIRE), found.shows("agv_mode")
    asks, holds = bool(commands.agv_mode_request), bool(commands.door_open)
    yield from checks.missing(settings, ("map",), told, asks, fire, holds)
    yield from checks.unseen(settings, found.shows)
    yield from checks.counts_down(settings, found.floor.codes, ("map", "floor", "codes"))
    for hazard in checks.ALARMED:
        flag = found.flag(hazard)
        if flag and flag.is_in("discrete input") and flag.active == "high":
            text = (
                f"if a wire leads here, a cut wire reads as no {hazard}: use a contact that opens"
            )
            yield ("map", hazard), f"{text} at the alarm, and active: low"
    if not commands.read_back:
        text = "commands cannot be read back: switching off is not verified"
        yield ("map", "commands", "read_back"), text
    for signal, path, command in commands.singles():
        if command.read_back is False and not signal.startswith("call_"):
            text = f"{signal} cannot be read back: switching it off is not verified"
            yield ("map", "commands", *path, "read_back"), text


def notes(settings: RegisterLiftSettings) -> Remarks:
    """Yield a note, with its path below the device, for each intended choice with side effects."""
    return checks.notes(settings, settings.map.shows)


def debounce(settings: RegisterLiftSettings) -> Mapping[str, float]:
    """Return the debounce times (s). A gateway may show a half-changed number. So its values have the
    same debounce times as contacts."""
    return {**DEBOUNCE_S, **dict.fromkeys(Hazard, HAZARD_DEBOUNCE_S)}


def claims(settings: RegisterLiftSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the register or coil of each command, with its path in the YAML. No other device may write
    to these registers and coils."""
    seen: set[str] = set()
    for path, place, _ in settings.map.commands.places():
        if place not in seen and misplaced(apart(place)[1], WRITABLE) is None:
            seen.add(place)
            yield str(point_at(settings.unit, place)), ("map", "commands", *path, "at")


def reads(settings: RegisterLiftSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the place of each part that the driver reads, with its path in the YAML. Leave out a part
    whose bits are none of the commands' bits in the same register."""
    written: dict[str, int] = {}
    for _, place, bits in settings.map.commands.places():
        written[place] = written.get(place, 0) | bits
    for name, part in settings.map.parts().items():
        place = place_of(part)
        own = place in written and not part.mask & written[place]
        if not own and misplaced(apart(place)[1], TABLES) is None:
            yield str(point_at(settings.unit, place)), ("map", name, "at")


def describe(settings: RegisterLiftSettings, bus: object) -> Iterator[tuple[str, str]]:
    """Yield rows for the command `check`. Each row names the register or coil of one value or
    command."""
    for name, part in settings.map.parts().items():
        yield name, f"{point_at(settings.unit, place_of(part))}{_meaning(part)}"
    commands = settings.map.commands
    for signal, _, command in commands.singles():
        yield signal, f"{point_at(settings.unit, place_of(command))} is written"
    if commands.call:
        yield "call", f"{point_at(settings.unit, place_of(commands.call))} is written"
    for place in sorted(commands.unread()):
        text = "written in every scan, and never read back"
        yield str(point_at(settings.unit, place)), text


def tables(settings: RegisterLiftSettings) -> Iterator[Table]:
    """Yield a table of the floors (lowest first). Then yield a table for each value that is a number,
    and a table of the commands."""
    yield floors(settings)
    for name, part in settings.map.parts().items():
        if isinstance(part, Number):
            yield Table(f"{name} numbers", NUMBERS, tuple(_numbers(part)))
    yield _outputs(settings)


def _numbers(part: Number) -> Iterator[tuple[str, str, str]]:
    meanings = [(number, str(meaning)) for number, meaning in part.codes.items()]
    if isinstance(part, FloorField):
        meanings += [(number, BETWEEN) for number in part.between_floors]
    others = ", other bits 0" if part.bits else ""
    for number, meaning in sorted(meanings):
        yield meaning, str(number), f"0x{part.word(number):04X}{others}"
    yield _unlisted(part), "any other", "-"


def _unlisted(part: Number) -> str:
    if isinstance(part, FloorField):
        return FAULT
    if isinstance(part, DoorField):
        return "neither open nor closed"
    return "a car that moves" if isinstance(part, MotionField) else "out_of_service"


def _outputs(settings: RegisterLiftSettings) -> Table:
    """Tabulate each command as if no other command were on. If commands share a register, the driver
    writes them as one value."""
    commands, off = settings.map.commands, settings.map.commands.words((), None)
    levels = settings.levels()
    rows = []
    for signal, _, command in commands.singles():
        if not signal.startswith("call_"):
            place = place_of(command)
            rows.append((signal, place, commands.words([signal], None)[place]))
    for level in levels:
        place = place_of(commands.call or commands.calls[level])
        rows.append((f"call {level}", place, commands.words([f"call_{level}"], level)[place]))
    told = tuple(
        (output, f"{place}: {value}", str(off[place]), how_long(settings, output))
        for output, place, value in rows
    )
    return Table("outputs", ("output", "writes", "off", "how long"), told)


def _meaning(part: Number | LiftFlag) -> str:
    text = ", only in AGV mode" if part.valid_when else ""
    if isinstance(part, LiftFlag):
        bit = "" if part.bit is None else f" bit {part.bit}"
        return f"{bit}: asserted at {int(part.active == 'high')}{text}"
    return (f" bits {', '.join(map(str, part.bits))}" if part.bits else "") + text


def create(name: str, settings: RegisterLiftSettings, bus: ModbusBus) -> "RegisterLift":
    """Make the lift's driver on its bus. The driver sends nothing before `open`."""
    inputs = {n: point_at(settings.unit, place_of(p)) for n, p in settings.map.parts().items()}
    safe = encode(settings.map, LiftOutputs())
    outputs = {place: point_at(settings.unit, place) for place in safe}
    commands, pulse = settings.map.commands, settings.limits.call_pulse_s is not None
    clearing = {place: Clearing(bits, pulse) for place, bits in commands.calling().items()}
    lines = ModbusLines(bus, inputs, outputs, safe, commands.unread(), clearing)
    return RegisterLift(settings.map, lines)


class RegisterLift:
    """The driver of one lift (`drivers.Driver[LiftSample, LiftOutputs]`)."""

    def __init__(self, found: LiftMap, lines: ModbusLines) -> None:
        self._map = found
        self._lines = lines

    def open(self) -> None:
        """Check that the gateway answers. When `open` is called for the first time, also switch every
        command off."""
        self._lines.claim()

    def read(self) -> LiftSample:
        """Read and decode every register now."""
        return decode(self._map, self._lines.read())

    def write(self, outputs: LiftOutputs) -> None:
        """Set every command to its level in `outputs`. First write the commands that go off."""
        self._lines.bring(encode(self._map, outputs))

    def make_safe(self) -> None:
        """Switch every command off. Read the commands back where the gateway allows this."""
        self._lines.make_safe()

    def close(self) -> None:
        """Switch every command off if the driver ever wrote one. Does not raise."""
        self._lines.close()


def encode(found: LiftMap, outputs: LiftOutputs) -> dict[str, int]:
    """Return the value to write to each register or coil. If commands share a register, combine their
    values with OR."""
    asserted = {"agv_mode_request"} if outputs.agv_request else set()
    if outputs.hold_door:
        asserted.add(HOLD[outputs.hold_door])
    if outputs.call is not None:
        asserted.add(f"call_{outputs.call}")
    return found.commands.words(asserted, outputs.call)


def decode(found: LiftMap, words: Mapping[str, int]) -> LiftSample:
    """Decode the registers. `words` gives a value for each part of the map. Never raises."""
    flags = {n: p.asserted(words[n]) for n, p in found.parts().items() if isinstance(p, LiftFlag)}
    service = _service(found, words)
    agv = _agv(found, flags, service)
    unknown = {n for n, part in found.parts().items() if part.valid_when and not agv}
    level, code_fault = (None, "") if "floor" in unknown else _floor(found, words)
    return LiftSample(
        level=level,
        door=_door(found, "door", words, unknown) or DoorReading.BETWEEN,
        code_fault=code_fault,
        rear_door=_door(found, "rear_door", words, unknown),
        motion=None if unknown.intersection(MOTION) else _motion(found, words),
        agv=agv,
        hazards=frozenset(
            h for h in Hazard if h == service or (h not in unknown and flags.get(h, False))
        ),
        floor_valid="floor" not in unknown,
    )


def _service(found: LiftMap, words: Mapping[str, int]) -> str | None:
    code = found.service
    return None if code is None else code.means(code.number(words["service"]))


def _agv(found: LiftMap, flags: Mapping[str, bool], service: str | None) -> bool | None:
    if found.agv_mode:
        return flags["agv_mode"]
    return service == "agv_mode" if found.shows("agv_mode") else None


def _floor(found: LiftMap, words: Mapping[str, int]) -> tuple[str | None, str]:
    number = found.floor.number(words["floor"])
    if number in found.floor.codes:
        return found.floor.codes[number], ""
    return None, "" if number in found.floor.between_floors else f"code {number} is no floor's code"


def _door(
    found: LiftMap, name: str, words: Mapping[str, int], unknown: Set[str]
) -> DoorReading | None:
    part: DoorField | None = getattr(found, name)
    if not unknown.isdisjoint((name, f"{name}_opened", f"{name}_closed")):
        return DoorReading.BETWEEN
    opened: LiftFlag | None = getattr(found, f"{name}_opened")
    closed: LiftFlag | None = getattr(found, f"{name}_closed")
    if opened and closed:
        ends = words[f"{name}_opened"], words[f"{name}_closed"]
        return BY_CONTACTS[opened.asserted(ends[0]), closed.asserted(ends[1])]
    if part is None:
        return None
    state = part.codes.get(part.number(words[name]))
    return DOOR[state] if state else DoorReading.UNKNOWN


def _motion(found: LiftMap, words: Mapping[str, int]) -> Motion | None:
    shown = {n: f.asserted(words[n]) for n in MOTION if (f := found.flag(n))}
    if "moving" in shown:
        return Motion.MOVING if shown["moving"] else Motion.STOPPED
    if "stopped" in shown:
        return Motion.STOPPED if shown["stopped"] else Motion.MOVING
    if "up" in shown:
        return UP_DOWN[shown["up"], shown["down"]]
    if found.motion is None:
        return None
    state = found.motion.codes.get(found.motion.number(words["motion"]))
    return Motion(state) if state else Motion.CONTRADICTORY


DRIVER = DriverType(
    settings=RegisterLiftSettings,
    buses=("modbus",),
    create=create,
    debounce=debounce,
    describe=describe,
    commands=lambda settings: [signal for signal, _, _ in settings.map.commands.singles()],
    tables=tables,
    claims=claims,
    reads=reads,
    warnings=warnings,
    notes=notes,
    fake="hal_fakes.modbus.register_lift",
)

"""Checks of a lift's wiring: problems, unsafe choices, warnings and notes."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial
from itertools import pairwise

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Hazard, Side
from bridges.kinds.shared.alarming import alarm_problems
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.points import Wire, are_pins, is_number
from drivers.lift import codes
from drivers.lift.broken_lines import floor_warnings, unsafe_codes
from drivers.lift.table import MOTION, input_rows, wires
from drivers.lift.wiring import FloorCode, LiftWiring
from drivers.unsafe import (
    Unsafe,
    cut_must_read,
    energised_at_boot,
    needlessly_accepted,
    slow_alarms,
    unaccepted,
)

ALARMED = (Hazard.FIRE, Hazard.CODE_BLUE, Hazard.EARTHQUAKE, Hazard.EMERGENCY)
"""The hazards that `alarm_on` may name."""


def problems(wiring: LiftWiring) -> Remarks:
    """Yield the problems that keep the daemon from starting. An unsafe choice that nobody has accepted
    is such a problem."""
    yield from floors(wiring)
    yield from alarm(wiring)
    yield from _floor_code(wiring.floor_code, wiring.levels())
    yield from _calls(wiring)
    yield from _doors(wiring)
    yield from _motion(wiring)
    yield from _agv(wiring)
    yield from _service(wiring)
    yield from unaccepted(unsafe(wiring), wiring.accept_unsafe)


def warnings(wiring: LiftWiring) -> Remarks:
    """Yield a warning for each kind of wiring that is valid but may be a mistake."""
    table = {w.signal: w for w in wires(wiring)}
    told = wiring.inputs.agv_mode is not None or _in_service(wiring, "agv_mode")
    fire = sees(wiring, Hazard.FIRE)
    asks, holds = bool(wiring.outputs.agv_mode_request), bool(wiring.outputs.door_open)
    yield from missing(wiring, ("inputs",), told, asks, fire, holds)
    yield from unseen(wiring, partial(sees, wiring))
    yield from slow_alarms(table[hazard] for hazard in Hazard if hazard in table)
    for hazard in ALARMED[1:]:
        for _, path, text in _cut(table, hazard, True, f"{hazard} reads clear"):
            yield path, text
    for signal in ("moving", "stopped", "up", "down"):
        reads_standing = signal == "stopped"
        for _, path, text in _cut(table, signal, not reads_standing, "the car reads as standing"):
            yield path, text
    if not wiring.floor_code.lines:
        yield from counts_down(wiring, wiring.floor_code.codes, ("floor_code", "codes"))
    confused = (
        "" if _in_register(wiring.floor_code, table) else floor_warnings(wiring.floor_code, table)
    )
    if confused:
        yield (
            ("floor_code",),
            f"{confused}: ask for a parity line, or for codes that differ in at least two lines",
        )
    yield from _partial_call(wiring, table)
    yield from needlessly_accepted(unsafe(wiring), wiring.accept_unsafe)


def missing(
    settings: LiftSettings, path: tuple[str, ...], told: bool, asks: bool, fire: bool, holds: bool
) -> Remarks:
    """Yield a warning for each optional signal that is absent.

    `told` is True if the lift reports AGV mode. `asks` is True if an output requests AGV mode. `fire`
    is True if the lift reports a fire. `holds` is True if an output holds the door open. `path` is the
    section of the YAML where the absent signal would be.
    """
    by_call = settings.agv_mode == "by_call"
    if not told:
        yield path, "no agv_mode: the lift cannot confirm that it serves the robot"
    elif not asks and not by_call:
        text = (
            "no agv_mode_request, although the daemon waits for AGV mode: the lift must enter AGV"
            " mode by itself"
        )
        yield (*path[:-1], "outputs") if path == ("inputs",) else path, text
    if by_call and not holds:
        text = "no door_open: with by_call nothing keeps AGV mode on while a robot enters or leaves"
        yield path, text
    if not fire:
        yield path, "no fire_alarm: a fire recall would not be seen"


Sees = Callable[[str], bool]
"""A function that returns whether the lift reports this hazard, by a line or by a code."""


def notes(settings: LiftSettings, sees: Sees) -> Remarks:
    """Yield a note for each setting that is no mistake, but has side effects that the site should
    know."""
    if sees(Hazard.FIRE) and settings.alarm == "none":
        text = (
            "a fire stops this lift for robots, but no topic tells the fleets about it"
            " (alarm: none)"
        )
        yield ("alarm",), text
    untold = [h for h in ALARMED if sees(h) and h not in settings.alarm_on]
    if untold and settings.alarm != "none":
        many = "stops" if len(untold) == 1 else "stop"
        text = f"{' and '.join(untold)} {many} this lift for robots, but no topic tells the fleets"
        yield ("alarm_on",), text


def alarm(settings: LiftSettings) -> Remarks:
    """Yield the problems with the alarm that the lift sends to the fleets."""
    yield from alarm_problems(settings)
    if settings.alarm == "none" and settings.alarm_on != [Hazard.FIRE]:
        yield ("alarm_on",), "alarm: none sends no alarm; write alarm: emergency_signal"


def unseen(settings: LiftSettings, sees: Sees) -> Remarks:
    """Yield a problem for each hazard of `alarm_on` that the lift does not report."""
    for n, hazard in enumerate(settings.alarm_on if settings.alarm != "none" else ()):
        if not sees(hazard):
            path = ("alarm_on", str(n)) if settings.alarm_on != [Hazard.FIRE] else ("alarm",)
            yield path, f"no {hazard}: this lift does not report it, so RMF gets no alarm"


def by_call(settings: LiftSettings, told: bool, asks: bool, request: tuple[str, ...]) -> Remarks:
    """Yield problems with `agv_mode: by_call`. It needs a lift that reports AGV mode (`told`). It
    forbids an output that requests AGV mode (`asks`). `request` is the path that such an output has
    in the YAML."""
    if settings.agv_mode == "by_call" and not told:
        text = (
            "by_call needs an agv_mode input, which alone shows that the lift has accepted a call"
        )
        yield ("agv_mode",), text
    if settings.agv_mode == "by_call" and asks:
        yield (
            request,
            "with agv_mode: by_call a call already requests AGV mode: delete this or by_call",
        )


def unsafe(wiring: LiftWiring) -> Iterator[Unsafe]:
    """Yield the wiring that `accept_unsafe` must name. With such wiring, a cut wire or the module's
    power-on could cause harm."""
    table = {w.signal: w for w in wires(wiring)}
    yield from _cut(table, Hazard.FIRE, True, "a fire alarm reads clear")
    yield from _cut(table, "agv_mode", False, "AGV mode reads on")
    for prefix in ("door", "rear_door"):
        single = getattr(wiring.inputs, prefix)
        if single:
            wanted = single.proves == "closed"
            yield from _cut(table, prefix, wanted, f"the {prefix} reads open")
        yield from _cut(table, f"{prefix}_opened", False, f"the {prefix} reads open")
    if not any(_floor_code(wiring.floor_code, wiring.levels())):
        yield from _dead_code(wiring.floor_code, table)
    yield from unsafe_codes(wiring, table)
    yield from energised_at_boot(table.values())


def _cut(table: Mapping[str, Wire], signal: str, asserted: bool, meaning: str) -> Iterable[Unsafe]:
    return cut_must_read(table[signal], asserted, meaning) if signal in table else ()


def floors(wiring: LiftSettings) -> Remarks:
    """Yield a problem if there are no floors. Yield a problem for a floor that is listed twice, and for
    two floors that are the same door of one landing."""
    stops = wiring.stops()
    if not stops:
        yield ("floors",), "no floors: list this lift's floors by their names on RMF's map"
    if len(stops) != len(wiring.floors):
        yield ("floors",), "a floor is named twice: delete one"
    seen: dict[object, str] = {}
    for name, stop in stops.items():
        if stop in seen:
            yield (
                ("floors", name),
                f"{name} and {seen[stop]} are the same door of landing {stop.level}",
            )
        seen[stop] = name


def counts_down(settings: LiftSettings, codes: Mapping[int, str], path: tuple[str, ...]) -> Remarks:
    """Yield a warning if the floors' code numbers decrease from the lowest floor to the highest."""
    levels = settings.levels()
    numbers = [min((n for n, at in codes.items() if at == level), default=0) for level in levels]
    if len(numbers) > 2 and all(above < below for below, above in pairwise(numbers)):
        lowest, highest = levels[0], levels[-1]
        yield (
            path,
            (
                f"these numbers count down from {lowest} to {highest}, but floors lists {lowest} as"
                " the lowest: one of the two lists is reversed, or the controller counts from the"
                " top"
            ),
        )


def named(
    what: str, section: tuple[str, ...], given: Collection[str], levels: Collection[str]
) -> Remarks:
    """Yield a problem for each landing that `given` lacks, and for each name in `given` that is not a
    landing. `what` is the word for an entry of `given` in the messages."""
    for level in given:
        if level not in levels:
            yield section, f"{level!r} is not a landing of this lift, which has {', '.join(levels)}"
    for level in levels:
        if level not in given:
            yield section, f"no {what} for {level}"


def _floor_code(code: FloorCode, levels: list[str]) -> Remarks:
    if code.encoding == "one_hot":
        yield from named("line", ("floor_code", "lines"), code.lines, levels)
        if code.bits or code.codes or code.parity:
            yield ("floor_code",), "one_hot has lines, and no bits, codes or parity"
        return
    if code.lines:
        yield (
            ("floor_code", "lines"),
            f"{code.encoding} needs bits and codes; only one_hot has lines",
        )
    if not code.bits:
        yield ("floor_code",), "no bits: list the lines, least significant first"
    yield from named("code", ("floor_code", "codes"), set(code.codes.values()), levels)
    for number in (*code.codes, *code.between_floors):
        try:
            codes.encode(code.encoding, number, len(code.bits))
        except ValueError as error:
            section = "codes" if number in code.codes else "between_floors"
            yield ("floor_code", section, str(number)), str(error)
    for number in code.codes:
        if number in code.between_floors:
            yield (
                ("floor_code", "codes", str(number)),
                f"{number} is {code.codes[number]} here, but is also in between_floors: write"
                f" between_floors: {[n for n in code.between_floors if n not in code.codes]}",
            )


def _calls(wiring: LiftWiring) -> Remarks:
    code = wiring.call_code
    if code is None:
        yield from named("call", ("calls",), wiring.calls, wiring.levels())
        return
    if wiring.calls:
        yield ("calls",), "calls and call_code are alternatives: delete one of the two"
    yield from named("code", ("call_code", "codes"), set(code.codes.values()), wiring.levels())
    for number in code.codes:
        if number == 0 or number >> len(code.bits):
            why = "0 is no call" if number == 0 else f"{number} does not fit on the bits"
            yield ("call_code", "codes", str(number)), why
    for number, text in codes.called_twice(code.codes):
        yield ("call_code", "codes", str(number)), text


def _partial_call(wiring: LiftWiring, table: Mapping[str, Wire]) -> Remarks:
    """Yield a warning if some bits of a landing's code are the code of another landing, and the bits
    cannot be switched together."""
    code = wiring.call_code
    if code is None or are_pins(wire for s, wire in table.items() if s.startswith("call_bit")):
        return
    for number, level in code.codes.items():
        for part, other in code.codes.items():
            if part & number == part and other != level:
                yield (
                    ("call_code",),
                    f"each bit is switched by a request of its own, so a call to {level} ({number}) may"
                    f" show {part}, which calls {other}, for a moment: if the controller also takes"
                    " calls from a register, use driver: register with call",
                )
                return


def _doors(wiring: LiftWiring) -> Remarks:
    inputs, outputs = wiring.inputs, wiring.outputs
    rear = any(stop.side is Side.REAR for stop in wiring.stops().values())
    for prefix, needed in (("door", True), ("rear_door", rear)):
        single = getattr(inputs, prefix)
        two = [getattr(inputs, f"{prefix}_{end}") for end in ("opened", "closed")]
        if single and any(two):
            yield (
                ("inputs", prefix),
                f"{prefix} is for a door with only one contact: delete {prefix}, or the other contacts",
            )
        elif any(two) and not all(two):
            have = f"{prefix}_opened" if two[0] else f"{prefix}_closed"
            end = "open" if two[0] else "closed"
            yield (
                ("inputs", have),
                f"is the only contact of this door: write {prefix}: {{…, proves: {end}}} instead",
            )
        elif needed and not single and not any(two):
            yield (
                ("inputs",),
                f"no contact of this door: give {prefix}, or both {prefix}_opened and {prefix}_closed",
            )
        elif not needed and (single or any(two)):
            yield ("inputs",), "a rear door is wired, but no floor has side: rear"
        travel_s = wiring.limits.door_travel_s
        if single and wiring.limits.door_timeout_s <= travel_s:
            text = (
                f"must be longer than door_travel_s ({travel_s:g} s), because otherwise no door"
                " opens in time"
            )
            yield ("limits", "door_timeout_s"), text
    if rear and outputs.door_open and not outputs.rear_door_open:
        yield ("outputs",), "no rear_door_open, but some floors have side: rear"


def _motion(wiring: LiftWiring) -> Remarks:
    have = [name for name in MOTION if getattr(wiring.inputs, name) is not None]
    if have not in ([], ["moving"], ["stopped"], ["up", "down"], ["motion"]):
        yield (
            ("inputs", have[0]),
            "the motion needs either moving, or stopped, or motion, or both up and down; not"
            f" {' with '.join(have)}",
        )
    motion = wiring.inputs.motion
    if motion is None:
        return
    shown = set(motion.codes.values())
    if "stopped" not in shown or not ("moving" in shown or {"up", "down"} <= shown):
        yield (
            ("inputs", "motion", "codes"),
            "needs a code for stopped; it also needs either one for moving, or both up and down",
        )
    for number in motion.codes:
        if number >> len(motion.bits):
            yield ("inputs", "motion", "codes", str(number)), f"{number} does not fit on the bits"


def _agv(wiring: LiftWiring) -> Remarks:
    by_line, by_code = wiring.inputs.agv_mode, _in_service(wiring, "agv_mode")
    told, asks = bool(by_line) or by_code, bool(wiring.outputs.agv_mode_request)
    yield from by_call(wiring, told, asks, ("outputs", "agv_mode_request"))
    if by_line and by_code:
        yield (
            ("inputs", "agv_mode"),
            "service has a code for agv_mode too: delete this input, or that code",
        )
    for signal, path, line in input_rows(wiring):
        if not line.valid_when:
            continue
        if not by_line and not by_code:
            yield path, "valid_when: agv_mode needs an agv_mode input"
        elif signal == "agv_mode" or signal.startswith("service_"):
            yield path, f"{signal} itself shows AGV mode: delete valid_when"


def _service(wiring: LiftWiring) -> Remarks:
    service = wiring.inputs.service
    if service is None:
        return
    every = set(range(2 ** len(service.bits)))
    for number in sorted(every - service.codes.keys()):
        yield ("inputs", "service", "codes"), f"{number} is missing: write its meaning"
    for number in sorted(service.codes.keys() - every):
        yield ("inputs", "service", "codes", str(number)), f"{number} does not fit on the bits"


def sees(wiring: LiftWiring, hazard: str) -> bool:
    """Return whether the lift reports this hazard, by a line or by its service code."""
    return getattr(wiring.inputs, hazard) is not None or _in_service(wiring, hazard)


def _in_service(wiring: LiftWiring, state: str) -> bool:
    service = wiring.inputs.service
    return service is not None and state in service.codes.values()


def _in_register(code: FloorCode, table: Mapping[str, Wire]) -> bool:
    return is_number(table[signal] for signal, _, _ in code.inputs())


def _dead_code(code: FloorCode, table: Mapping[str, Wire]) -> Iterator[Unsafe]:
    """Yield the floor code if it is unsafe when all its lines are cut at once. It is unsafe if it then
    reads as a floor. A cut cable or a lost supply cuts all lines."""
    if _in_register(code, table):
        return
    lines = [signal for signal, _, _ in code.inputs()]
    level, _ = code.read({signal: bool(table[signal].broken_reads()) for signal in lines})
    if level is not None:
        yield (
            lines[0],
            ("floor_code",),
            f"with the floor code's cable cut, the daemon reads the car at {level}",
        )

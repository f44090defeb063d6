"""Tabulates a lift's wiring. Each wire has a row with its signal, point and debounce."""

from collections.abc import Iterator

from bridges.kinds.lift.signals import Hazard
from drivers.hal.points import Clearing, Output, Wire
from drivers.lift.wiring import LiftInput, LiftWiring

DEBOUNCE_S = {"floor": 0.08, "door": 0.1, "rear_door": 0.1, "motion": 0.05, "agv_mode": 0.05}
"""The default debounce (s) of each group of signals. HAZARD_DEBOUNCE_S is the default for hazards and
service codes.

While the car passes a floor, its door may read open for 50 ms, which is a glitch. If there is no motion
line, only the debounce filters this glitch out.
"""

HAZARD_DEBOUNCE_S = 0.05
MOTION = ("moving", "stopped", "up", "down", "motion")

Row = tuple[str, tuple[str, ...], LiftInput]


def input_rows(wiring: LiftWiring) -> Iterator[Row]:
    """Yield (signal, path, line) for each input line. The path begins below the device."""
    for name in wiring.inputs.__struct_fields__:
        found = getattr(wiring.inputs, name)
        if isinstance(found, LiftInput):
            yield name, ("inputs", name), found
        elif found is not None:
            for i, bit in enumerate(found.bits):
                yield f"{name}_bit{i}", ("inputs", name, "bits", str(i)), bit
    for signal, path, line in wiring.floor_code.inputs():
        yield signal, ("floor_code", *path), line


def output_rows(wiring: LiftWiring) -> Iterator[tuple[str, tuple[str, ...], Output]]:
    """Yield (signal, path, line) for each output line. The path begins below the device."""
    for name in wiring.outputs.__struct_fields__:
        output = getattr(wiring.outputs, name)
        if output is not None:
            yield name, ("outputs", name), output
    for level, output in wiring.calls.items():
        yield f"call_{level}", ("calls", level), output
    for i, output in enumerate(wiring.call_code.bits if wiring.call_code else ()):
        yield f"call_bit{i}", ("call_code", "bits", str(i)), output


def wires(wiring: LiftWiring) -> list[Wire]:
    """Return the wiring table, with the default debounces. Inputs come first."""
    return [
        *(line.wire(s, path, _debounce_s(s, line)) for s, path, line in input_rows(wiring)),
        *(line.wire(s, path, clearing=_call(wiring, s)) for s, path, line in output_rows(wiring)),
    ]


def _call(wiring: LiftWiring, signal: str) -> Clearing | None:
    """Return how a controller may switch this output off by itself. Return None if the output is not a
    call."""
    pulse = wiring.limits.call_pulse_s is not None
    return Clearing(pulse=pulse) if signal.startswith("call_") else None


def group(signal: str) -> str:
    """Return a signal's group: `floor`, `door`, `rear_door`, `motion` or `service`. A signal outside
    these groups is its own group."""
    for name in ("floor", "door", "rear_door", "motion", "service"):
        if signal == name or signal.startswith(f"{name}_"):
            return name
    return "motion" if signal in MOTION else signal


def debounce(wiring: LiftWiring) -> dict[str, float]:
    """Return the debounce (s) of each group of signals. It is the longest debounce of the group's
    lines.

    If the service code shows a state, the state has the longest debounce of the service code's lines.
    """
    longest: dict[str, float] = {}
    for signal, _, line in input_rows(wiring):
        name = group(signal)
        longest[name] = max(longest.get(name, 0.0), _debounce_s(signal, line))
    service_s = longest.pop("service", 0.0)
    service = wiring.inputs.service
    for state in map(service.means, service.codes) if service else ():
        if state in (*Hazard, "agv_mode"):
            longest[state] = max(longest.get(state, 0.0), service_s)
    return longest


def conditional(wiring: LiftWiring) -> frozenset[str]:
    """Return the groups of signals that are valid only in AGV mode."""
    return frozenset(group(s) for s, _, line in input_rows(wiring) if line.valid_when)


def _debounce_s(signal: str, line: LiftInput) -> float:
    if line.debounce_s is not None:
        return line.debounce_s
    return DEBOUNCE_S.get(group(signal), HAZARD_DEBOUNCE_S)

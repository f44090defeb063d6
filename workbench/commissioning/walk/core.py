"""Decide when an output of a walk (`rmf-bridge walk`) is on, and when its effect counts as seen. All
functions are pure, because the present time is an argument.

Only one output is on at a time, for ON_S at most. The output goes off immediately if a reading fails or
is too old. The output also goes off if a reading shows that the output must not be on. Feedback may
come late, because a car needs time to move. If an input showed the effect before the output was
switched on, the input is no feedback.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

ON_S: Final = 5.0
FEEDBACK_S: Final = 120.0
STALE_S: Final = 1.0
"""Maximum age (s) of readings. With older readings, an output may neither be switched on nor stay
on."""


@dataclass(frozen=True, slots=True)
class WalkStep:
    """One output to test.

    - `outputs`: the value for the driver in which this output is on.
    - `expects`: the effect that a person should see.
    - `seen(sample)`: whether the effect is there; None if no input shows the effect.
    - `hindrance(sample)`: the reason why the output must not be on now; "" if the output may be on.
    """

    name: str
    does: str
    outputs: Any
    expects: str
    seen: Callable[[Any], bool] | None
    hindrance: Callable[[Any], str]


@dataclass(frozen=True, slots=True)
class WalkMemory:
    """The memory of a walk.

    - `on`: the step whose output is on.
    - `off_at`: time (monotonic s) at which the output goes off.
    - `waits`: the step whose feedback may come until `waits_until`.
    - `results`: step -> the effect seen.
    - `says`: why the last key had no effect, or why an output went off.
    """

    sample: Any = None
    read_at: float | None = None
    why_lost: str = "not read yet"
    on: int | None = None
    off_at: float = 0.0
    waits: int | None = None
    waits_until: float = 0.0
    results: Mapping[int, str] = field(default_factory=dict)
    says: str = ""


@dataclass(frozen=True, slots=True)
class InputsRead:
    """An event: the inputs were read."""

    sample: Any


@dataclass(frozen=True, slots=True)
class InputsLost:
    """An event: reading the inputs or writing the outputs failed."""

    why: str


@dataclass(frozen=True, slots=True)
class Switch:
    """An event: the person switches this step's output on or off."""

    step: int


@dataclass(frozen=True, slots=True)
class ByEye:
    """An event: the person reports whether the step's effect was seen."""

    step: int
    seen: bool


class Tick:
    """An event: time has passed."""


Event = InputsRead | InputsLost | Switch | ByEye | Tick


def decide(memory: WalkMemory, event: Event, now: float, steps: Sequence[WalkStep]) -> WalkMemory:
    """Return the memory after this event. The new memory tells which output is on."""
    match event:
        case InputsRead(sample):
            memory = replace(memory, sample=sample, read_at=now, why_lost="")
        case InputsLost(why):
            memory = replace(memory, why_lost=why)
        case Switch(step):
            memory = _switch(memory, step, now, steps)
        case ByEye(step, seen):
            told = "seen" if seen else "not seen"
            memory = replace(memory, results={**memory.results, step: f"{told}, by eye"})
    return _feedback(_limited(memory, now, steps), now, steps)


def output_of(memory: WalkMemory, steps: Sequence[WalkStep]) -> Any:
    """Return the outputs to write. Return None to switch all outputs off."""
    return None if memory.on is None else steps[memory.on].outputs


def _switch(memory: WalkMemory, step: int, now: float, steps: Sequence[WalkStep]) -> WalkMemory:
    if memory.on is not None:
        return _off(memory, "switched off")
    if why := _hindrance(memory, now, steps[step]):
        return replace(memory, says=f"{steps[step].name} stays off: {why}")
    tried = steps[step]
    proves = tried.seen is None or not tried.seen(memory.sample)
    told = "switched on, and nothing was seen"
    if not proves:
        told = "switched on; the inputs had shown the effect before, so the test proves nothing"
    return replace(
        memory,
        on=step,
        off_at=now + ON_S,
        waits=step if proves else None,
        waits_until=now + FEEDBACK_S,
        results={**memory.results, step: told},
        says=""
        if proves
        else f"the inputs already show the effect of {tried.name}, so they would prove nothing",
    )


def _limited(memory: WalkMemory, now: float, steps: Sequence[WalkStep]) -> WalkMemory:
    if memory.on is None:
        return memory
    if now >= memory.off_at:
        return _off(memory, f"{steps[memory.on].name} was on for {ON_S:g} s")
    why = _hindrance(memory, now, steps[memory.on])
    return _off(memory, f"{steps[memory.on].name} went off: {why}") if why else memory


def _off(memory: WalkMemory, says: str) -> WalkMemory:
    return replace(memory, on=None, says=says)


def _hindrance(memory: WalkMemory, now: float, step: WalkStep) -> str:
    if memory.why_lost:
        return memory.why_lost
    if memory.read_at is None or now - memory.read_at > STALE_S:
        return f"the inputs were not read for {STALE_S:g} s"
    return step.hindrance(memory.sample)


def _feedback(memory: WalkMemory, now: float, steps: Sequence[WalkStep]) -> WalkMemory:
    """Look whether the inputs show the feedback for which a step waits."""
    if memory.waits is None:
        return memory
    step = steps[memory.waits]
    if step.seen is not None and memory.read_at == now and step.seen(memory.sample):
        results = {**memory.results, memory.waits: f"seen: {step.expects}"}
        return replace(memory, results=results, waits=None)
    return replace(memory, waits=None) if now >= memory.waits_until else memory

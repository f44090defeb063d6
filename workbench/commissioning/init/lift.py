"""A lift on contacts."""

from collections.abc import Iterator

from workbench.commissioning.init.answers import LIFT_INPUTS, Answers, Impossible
from workbench.commissioning.init.points import Points
from workbench.commissioning.init.scalar import quoted

HAZARDS = tuple(LIFT_INPUTS)[:7]
DOOR_ENDS = {"door_opened": "open", "door_closed": "closed"}


def section(answers: Answers, points: Points) -> Iterator[str]:
    """The lines below the lift's name."""
    floors = [quoted(floor) for floor in answers.floors]
    if len(floors) < 2 or len(set(floors)) < len(floors):
        raise Impossible(f"a lift has at least two floors, each name once, not {', '.join(floors)}")
    calls = [
        f"      {floor}: {{{points.relay()}}}" for floor in floors
    ]  # first: they need most pins
    request, hold = points.relay(), points.relay()
    yield f"    floors: [{', '.join(floors)}]        # RMF's names, from below"
    yield "    inputs:"
    yield "      # Alarm loops are closed while all is well: an open contact or a cut wire is an alarm."
    for signal, meaning in LIFT_INPUTS.items():
        if signal in answers.signals:
            yield f"      {_input(signal, answers, points)}   # {meaning}"
    yield from _floor_code(answers, floors, points)
    yield "    outputs:"
    if "agv_mode" in answers.signals:
        yield f"      agv_mode_request: {{{request}}}   # asks the lift for AGV mode"
    yield f"      door_open: {{{hold}}}   # holds the door open for a robot"
    yield "    calls:                     # a car call for each floor"
    yield from calls


def _input(signal: str, answers: Answers, points: Points) -> str:
    if signal in HAZARDS:
        return f"{signal}: {{{points.loop()}}}"
    if signal in DOOR_ENDS and not set(DOOR_ENDS) <= set(answers.signals):
        return f"door: {{{points.contact()}, proves: {DOOR_ENDS[signal]}}}"
    return f"{signal}: {{{points.contact()}}}"


def _floor_code(answers: Answers, floors: list[str], points: Points) -> Iterator[str]:
    yield "    floor_code:                # lines that say where the car is"
    yield f"      encoding: {answers.encoding}"
    if answers.encoding == "one_hot":
        yield "      lines:                   # one for each floor; none is between floors"
        for floor in floors:
            yield f"        {floor}: {{{points.contact()}}}"
        return
    yield "      bits:                    # least significant first"
    for _ in range(len(floors).bit_length()):
        yield f"        - {{{points.contact()}}}"
    yield "      # The parity line shows a broken line. A lift without it: leave it out; check warns."
    yield f"      parity: {{{points.contact()}, total: even}}"
    codes = ", ".join(f"{number}: {floor}" for number, floor in enumerate(floors, start=1))
    yield f"      codes: {{{codes}}}"

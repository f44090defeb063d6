"""Draft the `map:` of a lift's gateway or of a door's operator. The answers describe the device's
registers."""

from collections.abc import Iterator, Sequence
from typing import Final

from workbench.commissioning.init.answers import DraftAnswers, Impossible

ABSENT: Final = "none"
"""Answer for a value that no register of the device holds."""
PLACES: Final = {
    "floor_at": ("the floor number", "input register 0"),
    "door_at": ("the door's number", "input register 1"),
    "motion_at": ("the car's motion as a number", "input register 2"),
    "agv_mode_at": ("the flag of AGV mode", "input register 3 bit 0"),
    "fire_alarm_at": ("the flag of the fire alarm", "input register 3 bit 1"),
    "request_at": ("the request for AGV mode", "holding register 0"),
    "hold_at": ("the command that holds the door open", "holding register 1"),
    "call_at": ("the number of the called floor", "holding register 2"),
}
"""Name of an answer -> the device's value, and the register that `init` offers by default."""
DOOR_PLACES: Final = ("door_at", "hold_at")
OPTIONAL: Final = ("motion_at", "agv_mode_at", "fire_alarm_at", "request_at")
NUMBERS: Final = {
    "floor_numbers": "the floors, from the lowest floor up",
    "door_numbers": "closed, moving, open",
    "motion_numbers": "stopped, up, down",
}
"""Name of an answer -> the meanings of the numbers that the person gives, in order."""


def questions() -> dict[str, str]:
    """Return answer name -> question, in the order in which `init` asks."""
    texts = {}
    for name, (part, _) in PLACES.items():
        texts[name] = f"The register of {part}" + (", or none?" if name in OPTIONAL else "?")
        numbers = name.replace("_at", "_numbers")
        if numbers in NUMBERS:
            texts[numbers] = f"The numbers of {NUMBERS[numbers]}?"
    return texts


def lift(answers: DraftAnswers, floors: Sequence[str]) -> Iterator[str]:
    """Yield the lines below the name of a lift on a gateway."""
    codes = _codes(answers, "floor_numbers", floors)
    at = answers.places
    yield f"    unit: {answers.unit}"
    yield f"    floors: [{', '.join(floors)}]        # RMF's names, from the lowest floor up"
    yield "    map:                       # addresses begin at 0; an unlisted number is a fault"
    yield f"      floor: {{at: {at['floor_at']}, codes: {codes}}}"
    doors = _codes(answers, "door_numbers", ("closed", "moving", "open"))
    yield f"      door: {{at: {at['door_at']}, codes: {doors}}}"
    if at["motion_at"] != ABSENT:
        motions = _codes(answers, "motion_numbers", ("stopped", "up", "down"))
        yield f"      motion: {{at: {at['motion_at']}, codes: {motions}}}"
    for flag in ("agv_mode", "fire_alarm"):
        if at[f"{flag}_at"] != ABSENT:
            place, bit, number = at[f"{flag}_at"].partition(" bit ")
            yield f"      {flag}: {{at: {place}{', bit: ' if bit else ''}{number}, active: high}}"
    yield "      commands:"
    if at["request_at"] != ABSENT:
        yield f"        agv_mode_request: {{at: {at['request_at']}, ask: 1, release: 0}}"
    yield f"        door_open: {{at: {at['hold_at']}, ask: 1, release: 0}}"
    unused = next(
        number for number in range(65536) if number not in _numbers(answers, "floor_numbers")
    )
    yield f"        call: {{at: {at['call_at']}, codes: {codes}, none: {unused}}}   # none: no call"


def door(answers: DraftAnswers) -> Iterator[str]:
    """Yield the lines below the name of a door on an operator's registers."""
    at = answers.places
    closed, moving, opened = _numbers(answers, "door_numbers", 3)
    yield f"    unit: {answers.unit}"
    yield "    map:                       # addresses begin at 0; an unlisted number is a fault"
    yield (
        f"      status: {{at: {at['door_at']}, closed: [{closed}], moving: [{moving}],"
        f" open: [{opened}]}}"
    )
    yield f"      command: {{at: {at['hold_at']}, hold: 1, release: 0}}"


def _codes(answers: DraftAnswers, name: str, meanings: Sequence[str]) -> str:
    numbers = _numbers(answers, name, len(meanings))
    return "{" + ", ".join(f"{n}: {m}" for n, m in zip(numbers, meanings, strict=True)) + "}"


def _numbers(answers: DraftAnswers, name: str, many: int | None = None) -> list[int]:
    """Return the answer's numbers. Raises Impossible for an answer that is no list of numbers, and for
    too few or too many numbers."""
    told = [part.strip() for part in answers.places[name].split(",")]
    distinct = {int(part) for part in told if part.isascii() and part.isdigit()}
    if len(distinct) < len(told) or (many is not None and len(told) != many):
        raise Impossible(
            f"{name} is '{answers.places[name]}': write a whole number for each of"
            f" {NUMBERS[name]}, each number once, with commas between"
        )
    return [int(part) for part in told]

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
NO_CALL: Final = "no_call_number"
"""Name of the answer for the number that the call register holds while there is no call."""


def questions() -> dict[str, str]:
    """Return answer name -> question, in the order in which `init` asks."""
    texts = {}
    for name, (part, _) in PLACES.items():
        texts[name] = f"The register of {part}" + (", or none?" if name in OPTIONAL else "?")
        numbers = name.replace("_at", "_numbers")
        if numbers in NUMBERS:
            texts[numbers] = f"The numbers of {NUMBERS[numbers]}?"
    return texts | {NO_CALL: "The number for no call?"}


def offered_no_call(floor_numbers: str) -> str:
    """Return 0 as the usual number for no call. Return "" if a floor has the number 0, because a wrong
    number could call the car, and then only the gateway's register list tells the right number."""
    return "" if 0 in _listed(floor_numbers) else "0"


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
    none = _no_call(answers)
    yield f"        call: {{at: {at['call_at']}, codes: {codes}, none: {none}}}   # none: no call"


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
    numbers = _listed(answers.places[name])
    if len(set(numbers) - {None}) < len(numbers) or (many is not None and len(numbers) != many):
        raise Impossible(
            f"{name} is '{answers.places[name]}': write a whole number for each of"
            f" {NUMBERS[name]}, each number once, with commas between"
        )
    return [number for number in numbers if number is not None]


def _no_call(answers: DraftAnswers) -> int:
    """Return the number for no call. Raises Impossible without a number, and for a floor's number."""
    told, floors = answers.places[NO_CALL], answers.places["floor_numbers"]
    if not told.strip():
        raise Impossible(
            f"0 is a floor's number ({floors}), so it cannot mean no call: give --no-call-number"
            " with the gateway's number for no call"
        )
    numbers = _listed(told)
    if len(numbers) != 1 or numbers[0] is None or numbers[0] in _listed(floors):
        raise Impossible(
            f"{NO_CALL} is '{told}': write one whole number that is no floor's number ({floors})"
        )
    return numbers[0]


def _listed(text: str) -> list[int | None]:
    """Return the numbers of a text with commas between them. None stands for a part that is no whole
    number."""
    parts = [part.strip() for part in text.split(",")]
    return [int(part) if part.isascii() and part.isdigit() else None for part in parts]

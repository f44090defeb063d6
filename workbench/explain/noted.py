"""Notes, which are entries that our own programs write into a recording. Our daemons note inputs,
outputs, faults, bus errors and refusals of their devices. Our recorder notes its reason to keep the
file.

In an incident file, the notes are JSON texts under `/rmf_bridge/` (`bridges/blackbox/incident.py`,
`readable`). A file may come from anywhere, so the reader ignores texts of another shape.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import msgspec

from workbench.explain.timeline import Level

TOPICS: Final = ("samples", "outputs", "faults", "decisions", "bus_errors", "notes")
MOST: Final = 40
"""Maximum number of inputs, outputs or faults that the reader takes from one note."""


@dataclass(frozen=True, slots=True)
class Noted:
    """One note about `subject`.

    - `inputs`, `outputs`, `faults`: name -> value; "" means off. Each lists everything that is on. None
      means that this note is about something else.
    - `refused`: why the daemon refused a request.
    - `bus_error`: why the bus failed.
    - `kept_for`: the recorder's reason to keep the file, as a fixed name and a text.
    """

    subject: str
    inputs: Mapping[str, str] | None = None
    outputs: Mapping[str, str] | None = None
    faults: Mapping[str, str] | None = None
    refused: str = ""
    bus_error: str = ""
    kept_for: tuple[str, str] | None = None


def noted(topic: str, text: str) -> Noted | None:
    """Return the note in this text. Return None if the text is no note. `topic` is the last part of the
    topic's name."""
    try:
        told = msgspec.json.decode(text)
    except (msgspec.MsgspecError, RecursionError):
        return None
    if not isinstance(told, dict) or not isinstance(subject := told.get("subject"), str):
        return None
    match topic:
        case "samples":
            return Noted(subject, inputs=dict(_fields(told.get("sample"))))
        case "outputs":
            return Noted(subject, outputs=dict(_fields(told.get("outputs"))))
        case "faults":
            return Noted(subject, faults=dict(_faults(told.get("faults"))))
        case "decisions" if isinstance(refused := told.get("refused"), str) and refused:
            return Noted(subject, refused=refused)
        case "bus_errors" if isinstance(reason := told.get("reason"), str):
            return Noted(subject, bus_error=reason or "it failed")
        case "notes":
            match told:
                case {"code": str() as code, "text": str() as text}:
                    return Noted(subject, kept_for=(code, text))
    return None


def levels(at: float, note: Noted, on: dict[tuple[str, str], str]) -> Iterator[Level]:
    """Yield the changes that this note reports. `on` has the values before the note, as name -> value.
    This function updates `on`."""
    lanes = (("inputs", note.inputs), ("relays", note.outputs), ("faults", note.faults))
    for lane, found in lanes:
        if found is None:
            continue
        names = [name for known, name in on if known == lane and name not in found]
        for name, value in {**dict.fromkeys(names, ""), **found}.items():
            if on.get((lane, name), "") != value:
                on[lane, name] = value
                yield Level(at, lane, name, value)  # type: ignore[arg-type]


def _fields(struct: object) -> Iterator[tuple[str, str]]:
    """Yield each field of a sample or output. The value is on, off or a word. Leave out
    measurements."""
    if not isinstance(struct, dict):
        return
    for name, value in [*struct.items()][:MOST]:
        if isinstance(name, str) and name and (shown := _shown(value)) is not None:
            yield name, shown


def _shown(value: object) -> str | None:
    match value:
        case None | False:
            return ""
        case True:
            return "on"
        case str():
            return value
        case {"=": str() as word}:
            return word.lower().replace("_", " ")
        case {"=": list() as several}:
            return ", ".join(filter(None, (_shown(one) for one in several[:MOST])))
    return None


def _faults(found: object) -> Iterator[tuple[str, str]]:
    for fault in found[:MOST] if isinstance(found, list) else ():
        match fault:
            case {"code": str() as code, "detail": str() as detail}:
                yield code, detail or code

"""A recording of a ride, in the form of our recorder's files."""

from pathlib import Path

from msgspec.structs import replace

from bridges import __version__
from bridges.blackbox import mcap_write
from bridges.blackbox.entries import AnyEntry, Clocks, Head, Spoken
from bridges.blackbox.incident import Incident, Note
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages import cdr
from bridges.messages import definitions as d
from bridges.messages.definitions import Message
from bridges.messages.releases import RELEASES
from bridges.messages.rihs01 import type_name
from bridges.messages.stamps import stamp

WALL = 1_795_000_000.0
LIFT = d.LiftState(
    lift_name="Lift1", available_floors=("L1", "L2", "L3"), current_floor="L1", current_mode=2
)


def write(path: Path, lift: str = "Lift1", seconds: int = 60) -> Path:
    """Write a robot's ride from L1 to L3. The file has a state each second, and the robot's
    requests."""
    head = Head(
        "run", 1, __version__, "lift", "/etc/a.yaml", b"", {}, True, {}, RecordingSettings()
    )
    entries: list[AnyEntry] = [Clocks(0.0, WALL)]
    for at in range(seconds):
        entries += [_spoken(at, True, "lift_states", _state(lift, at))]
        if 5 <= at < 50:
            asked = d.LiftRequest(lift, stamp(WALL + at), "fleet/robot", 1, "L3", 2)
            entries += [_spoken(at, False, "lift_requests", asked)]
    note = Note(30.0, "OPERATOR", "<b>it was slow</b>", lift)
    mcap_write.write(path, Incident(head, entries, (note,)))
    return path


def _state(lift: str, at: int) -> d.LiftState:
    floor = "L1" if at < 20 else "L2" if at < 25 else "L3"
    session = "fleet/robot" if 6 <= at < 50 else ""
    door = 2 if at in range(8, 18) or at > 30 else 0
    return replace(
        LIFT,
        lift_name=lift,
        lift_time=stamp(WALL + at),
        current_floor=floor,
        session_id=session,
        door_state=door,
    )


def _spoken(at: float, sent: bool, topic: str, message: Message) -> Spoken:
    kind = type(message)
    sample = cdr.encode(kind, message, RELEASES["jazzy"])
    return Spoken(float(at), sent, topic, type_name(kind), "jazzy", sample)

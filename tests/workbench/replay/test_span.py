"""The part of a recording that `--from` and `--to` choose."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from bridges.messages.definitions import DoorState
from bridges.messages.heard import Heard
from workbench.replay import recordings
from workbench.replay.recordings import RecordingSpan, TypedTime

NOON = 1.7e9
STEP_S = 7200.0


def set_ahead(*_: object) -> Iterator[Heard]:
    """Yield a message each second for 200 s. At 20 s the network sets the wall clock 2 h ahead."""
    for at in range(200):
        wall = NOON + at + (STEP_S if at >= 20 else 0.0)
        yield Heard(1000.0 + at, wall, "door_states", DoorState())


@pytest.mark.parametrize(
    ("from_s", "to_s", "first", "last"),
    [(None, 90.0, 0, 90), (60.0, None, 60, 199), (10.0, 30.0, 10, 30)],
)
def test_seconds_after_the_beginning_do_not_follow_a_step_of_the_wall_clock(
    monkeypatch: pytest.MonkeyPatch, from_s: float | None, to_s: float | None, first: int, last: int
) -> None:
    monkeypatch.setattr(recordings, "all_in", set_ahead)
    from_, to = (None if time is None else TypedTime(after_s=time) for time in (from_s, to_s))
    chosen = recordings.within(Path("x"), RecordingSpan(from_, to), "explain")
    assert [heard.at - 1000.0 for heard in chosen] == list(range(first, last + 1))

"""Replays of recordings from simulated days. Each replay gives the recorded decisions again, and the
recorded memories of the daemons."""

import os
from pathlib import Path

import pytest
import yaml
from msgspec.structs import replace

from bridges.blackbox.entries import Decided, Known
from bridges.blackbox.ring import RingContent
from bridges.blackbox.value_codec import value
from bridges.cli import main
from bridges.kinds.lift import core as lift_core
from bridges.kinds.shared.decision import Fault
from tests.blackbox.kept import keep
from tests.depth import depth
from tests.site.day import Site
from workbench.replay.files import opened
from workbench.replay.replayed import CONTEXT, Difference, Replay, ReplayedCores, of_head
from workbench.replay.sources import Notes

MB = 1_000_000
HERE = Path(__file__).parent / "corpus"
CORPUS = sorted(HERE.glob("*.mcap"))


@pytest.mark.long(5)
@pytest.mark.parametrize("seed", depth([1], [1, 3]))
def test_whatever_happens_at_a_site_is_decided_again_in_the_same_way(
    seed: int, tmp_path: Path
) -> None:
    site = Site(seed)
    rings = keep(site, tmp_path, 64 * MB)
    site.run(depth(6, 20) / 60)
    found = {}
    for name, ring in rings.items():
        read = RingContent(ring)
        replay = Replay(read.entries(), ReplayedCores(of_head(read.head)))
        assert list(replay.differences()) == []
        found[name] = (replay.course.decisions > 30, replay.course.unusable)

    assert found == dict.fromkeys(rings, (True, 0))


@pytest.mark.long(3)
def test_a_ring_that_has_turned_many_times_begins_where_all_is_known(tmp_path: Path) -> None:
    site = Site(3)
    rings = keep(site, tmp_path, MB // 20)
    site.run(depth(6, 20) / 60)

    for name in ("Lift1", "ward", "bay1"):
        read = RingContent(rings[name])
        replay = Replay(read.entries(), ReplayedCores(of_head(read.head)))
        assert list(replay.differences()) == []
        assert (replay.course.subjects, replay.course.unusable) == ({name}, 0)
        assert min(read.segments) > 1


@pytest.mark.parametrize("file", CORPUS, ids=lambda file: file.stem)
def test_each_incident_of_the_soak_is_decided_as_it_was_recorded(file: Path) -> None:
    """If a daemon's decisions were changed deliberately, record the incidents again with `python -m
    tests.workbench.replay.corpus`."""
    notes = Notes()
    head, entries = opened(file, notes)
    replay = Replay(entries, ReplayedCores(of_head(head)))

    assert [summary(one) for one in replay.differences()] == []
    assert (notes.damage, replay.course.unusable) == ("", 0)
    assert replay.course.decisions > 40


def test_a_change_of_a_core_is_seen_with_what_led_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """In this test, the lift's changed decisions report no faults. The difference found shows the
    events before the missing fault."""
    monkeypatch.setattr(lift_core, "_faults", lambda memory, view, now, limits: ())
    head, entries = opened(HERE / "Lift1_1.mcap", Notes())

    [found] = Replay(entries, ReplayedCores(of_head(head))).differences()

    recorded, today = value(found.recorded), value(found.today)
    assert (found.subject, found.what) == ("Lift1", "news")
    assert recorded[-1] == tuple(fault.code for fault in recorded_faults())
    assert today == (*recorded[:-1], ())
    assert len(found.before) == CONTEXT
    assert found.before[-1][0] == found.wall


def test_other_limits_show_what_they_would_have_changed_and_the_same_ones_nothing() -> None:
    head, _ = opened(HERE / "Lift1_1.mcap", Notes())
    content = yaml.safe_load(head.yaml)
    limits = content["lifts"]["Lift1"].setdefault("limits", {})
    found = {}
    for wait_s in (limits["dead_time_s"], 3.0):
        limits["dead_time_s"] = wait_s
        other = replace(head, yaml=yaml.safe_dump(content).encode())
        _, entries = opened(HERE / "Lift1_1.mcap", Notes())
        changes = list(Replay(entries, ReplayedCores(of_head(other))).changes())
        found[wait_s] = {one.what for one in changes}

    assert found.pop(3.0) >= {"outputs"}
    assert list(found.values()) == [set()]


def test_a_change_is_shown_once_with_its_end_and_how_often_it_came(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head, _ = opened(HERE / "Lift1_1.mcap", Notes())
    longer = head.yaml.replace(b"release_grace_s: 3.0", b"release_grace_s: 6.0")
    (tmp_path / "other.yaml").write_bytes(longer)
    assert (
        main(["replay", str(HERE / "Lift1_1.mcap"), "--config", str(tmp_path / "other.yaml")]) == 1
    )
    lines = [line.split(" Lift1: ") for line in capsys.readouterr().out.splitlines()[1:]]
    assert [(when.count(" to "), what) for when, what in lines] == [
        (1, "outputs: agv_request yes (recorded: -)"),
        (1, "state: -, - (recorded: L4, fleet/green)"),
        (0, lines[2][1]),
        (1, "outputs: agv_request yes (recorded: agv_request yes, hold_door front)"),
        (1, "outputs: - (recorded: agv_request yes, hold_door front)"),
        (1, "state: DOOR_MOVING, MOTION_UNKNOWN (recorded: DOOR_OPEN, MOTION_STOPPED)"),
    ]
    refused = "refused: released a moment ago: by fleet/red (recorded: -); 10 times, the last "
    assert lines[2][1].startswith(refused)


@pytest.mark.parametrize(("other", "lacks"), [("Lift2_1", "Lift2"), ("bay1_1", "charger")])
def test_the_yaml_of_another_device_is_refused_with_both_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], other: str, lacks: str
) -> None:
    head, _ = opened(HERE / f"{other}.mcap", Notes())
    (tmp_path / "other.yaml").write_bytes(head.yaml)
    file = str(HERE / "Lift1_1.mcap")
    assert main(["replay", file, "--config", str(tmp_path / "other.yaml")]) == os.EX_DATAERR
    said = capsys.readouterr()
    assert said.out == ""
    assert f"other.yaml describes {lacks}" in said.err.replace(" a ", " ")
    assert f"{file} records" in said.err


def test_what_cannot_be_replayed_is_counted(tmp_path: Path) -> None:
    """Replay a recording without `Known` entries. A replay starts from the memory in such an entry. A
    recording with a damaged beginning also lacks these entries."""
    head, entries = opened(HERE / "bay1_1.mcap", Notes())
    replay = Replay(
        [one for one in entries if not isinstance(one, Known)], ReplayedCores(of_head(head))
    )

    assert list(replay.differences()) == []
    assert (replay.course.decisions, replay.course.subjects) == (0, set())
    assert replay.course.unusable > 5


def recorded_faults() -> tuple[Fault, ...]:
    """Return the faults of the first decision with a fault in the recording of Lift1."""
    _, entries = opened(HERE / "Lift1_1.mcap", Notes())
    steps = [one for one in entries if isinstance(one, Decided) and one.faults not in ([], [[]])]
    return tuple(value(steps[0].faults[0]))


def summary(found: Difference) -> str:
    """Return a difference in one line, for the report of a failed test."""
    return f"{found.subject} {found.what}: {found.recorded} -> {found.today} after {found.before}"

"""`rmf-bridge judge` as a command: its options, recordings and output."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from bridges.cli import main
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.releases import JAZZY
from bridges.messages.stamps import stamp
from bridges.messages.topics import VOLATILE, AnyTopic
from tests.site.timeline import EPOCH
from tests.workbench.judge.script import lift
from tests.workbench.judge.test_adapter_occasions import STORIES
from tests.workbench.replay.written import MCAP, SQLITE, write
from workbench.commands.judge import Live
from workbench.judge.judge import JudgedKind

CALLED_BACK = STORIES["A7.rides"][2]
CORPUS = Path(__file__).parents[1] / "replay" / "corpus"


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("judge lift", "which lift? Give the NAME"),
        ("judge lift Lift1 --ride L1 L3", "this would move the lift 'Lift1': to permit it, add"),
        ("judge lift Lift1 --active", "--active moves a lift with --ride A B"),
        ("judge door ward --active --ride L1 L3", "--active moves a lift with --ride A B"),
        ("judge lift Lift1 --active --ride L1 L3 --restarts", "--restarts needs --localhost"),
        ("judge charger a --charge", "this would move the charger 'a'"),
        ("judge lift Lift1 --active --ride L1 L3 --recording x", "judge moves no device"),
        ("judge lift Lift1 --for 0", "'0': write 0.1 to 604800 seconds"),
    ],
)
def test_a_command_line_that_contradicts_itself_exits_2(
    line: str, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(line.split())
    assert left.value.code == 2
    assert why in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "kind", "name"),
    [
        ("Lift1_1", "lift", "Lift1"),
        ("Lift2_1", "lift", "Lift2"),
        ("ward_3", "door", "ward"),
        ("store_1", "door", "store"),
        ("bay1_1", "charger", "bay1"),
        ("bay2_1", "charger", "bay2"),
    ],
)
def test_the_recordings_of_our_own_daemons_in_trouble_accuse_none_of_them(
    file: str, kind: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["judge", kind, name, "--recording", str(CORPUS / f"{file}.mcap")]) == 0
    assert capsys.readouterr().out.startswith(f"{kind} {name}: 0 broken, ")


def ride_that_outlives_its_end() -> Iterator[Heard]:
    """Yield the messages of a lift that keeps the session after END."""
    for n in range(20):
        at = float(n)
        held = "fleet/red" if n > 4 else ""
        state = d.LiftState(
            lift_time=stamp(EPOCH + at),
            lift_name="Lift1",
            available_floors=("L1", "L3"),
            current_floor="L1",
            current_mode=2,
            session_id=held,
        )
        yield Heard(at, EPOCH + at, "lift_states", state)
        if n == 4:
            yield Heard(at + 0.5, EPOCH + at + 0.5, "lift_requests", lift("fleet/red", "L1"))
        if n == 10:
            end = lift("fleet/red", "", kind=0)
            yield Heard(at + 0.5, EPOCH + at + 0.5, "lift_requests", end)


@pytest.mark.parametrize("storage", [MCAP, SQLITE])
def test_a_recording_of_rosbag2_shows_the_law_the_message_and_the_time(
    storage: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write(tmp_path / "bag", ride_that_outlives_its_end(), JAZZY, storage)  # type: ignore[arg-type]
    junit = tmp_path / "verdict.xml"
    judge = ["judge", "lift", "Lift1", "--recording", str(bag), "--junit", str(junit)]
    assert main([*judge, "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    [broken] = [law for law in told["laws"] if law["verdict"] == "broken"]
    assert (broken["id"], broken["times"]) == ("L5.ends", 6)
    first = broken["evidence"][0]
    text = "still held by 'fleet/red' 3.5 s after its END without a floor"
    assert (round(first["wall"] - EPOCH, 3), first["text"]) == (14.0, text)
    suite = ElementTree.parse(junit).getroot()
    assert [suite.get(key) for key in ("tests", "failures")] == [str(len(told["laws"])), "1"]
    [failure] = suite.iter("failure")
    assert failure.get("message", "").endswith(text)


def test_a_fleet_adapter_is_judged_from_a_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = [Heard(at, EPOCH + at, topic.name, message) for at, topic, message in CALLED_BACK]
    bag = write(tmp_path / "bag", sorted(told, key=lambda one: one.at), JAZZY)
    assert main(["judge", "adapter", "fleet", "--recording", str(bag)]) == 1
    out = capsys.readouterr().out
    assert "adapter fleet: 2 broken, " in out
    assert "BROKEN    A7.floor" in out
    assert "BROKEN    A7.rides" in out
    assert "'fleet/red' asks for 'L2' on its ride to 'L3'" in out
    assert main(["judge", "adapter", "nobody", "--recording", str(bag)]) == 69
    assert "adapter nobody: no request heard in 21 s; heard: 'fleet'" in capsys.readouterr().out


def test_a_recording_is_judged_from_a_time_to_a_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write(tmp_path / "bag", ride_that_outlives_its_end(), JAZZY)
    judge = ["judge", "lift", "Lift1", "--recording", str(bag)]
    assert main([*judge, "--to", "+12"]) == 0
    assert main([*judge, "--from", "+11"]) == 0
    out = capsys.readouterr().out
    assert "13 states in 12 s" in out
    assert "9 states in 8 s" in out
    assert main([*judge, "--from", "+100"]) == 69


def test_a_file_that_is_not_a_recording_or_cannot_be_written_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["judge", "lift", "Lift1", "--recording", __file__]) == 66
    bag = write(tmp_path / "bag", ride_that_outlives_its_end(), JAZZY)
    nowhere = str(tmp_path / "no" / "such" / "folder.xml")
    judge = ["judge", "lift", "Lift1", "--recording", str(bag), "--junit", nowhere]
    assert main(judge) == 73
    told = capsys.readouterr().err
    assert "is not a recording" in told
    assert f"{nowhere} cannot be written: No such file or directory" in told


class Graph:
    """A transport on which "/node" publishes on some topics. The value tells whether the publisher
    retains its messages."""

    def __init__(self, publishers: Mapping[AnyTopic, bool]) -> None:
        self._publishers = {topic.name: retains for topic, retains in publishers.items()}

    def subscribe(self, topic: AnyTopic, received: object, *, others_only: bool = False) -> "End":
        retains = self._publishers.get(topic.name)
        hears = retains is not None and (retains or topic.subscribe == VOLATILE)
        return End(["/node"] if hears else [])


class End:
    def __init__(self, names: list[str]) -> None:
        self.senders = lambda: names


FIRE, SIGNAL = topics.FIRE_ALARM_TRIGGER, topics.EMERGENCY_SIGNAL


@pytest.mark.parametrize(
    ("kind", "publishers", "publishes", "retains"),
    [
        ("alarm", {FIRE: True, SIGNAL: True}, True, True),
        ("alarm", {FIRE: False, SIGNAL: True}, True, False),
        ("alarm", {SIGNAL: False}, True, False),
        ("alarm", {}, False, False),
        ("lift", {FIRE: False, SIGNAL: True}, True, False),
        ("lift", {FIRE: True, SIGNAL: False}, True, True),
        ("lift", {SIGNAL: False}, False, False),
    ],
)
def test_the_publishers_of_the_two_alarm_topics_are_looked_at_one_by_one(
    kind: JudgedKind, publishers: Mapping[AnyTopic, bool], publishes: bool, retains: bool
) -> None:
    graph: Any = Graph(publishers)
    found = Live(graph, kind, [], None).alarm_publishers()
    assert found == ({"/node"} if publishes else set(), {"/node"} if retains else set())

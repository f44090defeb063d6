"""`rmf-bridge explain` and `plot` as a person types them, on recordings of every kind."""

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from bridges import cli
from bridges.messages import topics
from bridges.messages.definitions import LiftState
from bridges.messages.heard import Heard
from bridges.messages.releases import NEWEST
from hal_fakes.wire import wire
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.workbench.explain.situations import fire, held_by_another
from tests.workbench.replay.written import MCAP, SQLITE, write
from workbench.explain.heard_devices import HeardDevices
from workbench.graph import live
from workbench.replay.recordings import FIRST_OF_OTHERS, Sieve

PNG = b"\x89PNG\r\n"


@pytest.fixture(autouse=True)
def _in_utc(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TZ", "UTC")
    __import__("time").tzset()


@pytest.fixture(scope="module")
def heard() -> list[Heard]:
    return held_by_another()[0]


@pytest.fixture(params=[MCAP, SQLITE], ids=["mcap", "sqlite3"])
def bag(request: pytest.FixtureRequest, tmp_path: Path, heard: list[Heard]) -> Path:
    return write(tmp_path / "bag", heard, NEWEST, request.param)


def run(*arguments: object) -> int:
    return cli.main([str(argument) for argument in arguments])


def test_a_recording_is_explained(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("explain", bag) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0] == "lift Lift1, heard from 2027-01-15 08:00:04 to 08:00:17 (14 s)"
    assert told[2] == "fleet/blue has waited since 08:00:08 (9.7 s) for Lift1 at L1."


def test_explain_prints_json_on_request(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("explain", bag, "Lift1", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["asks"], told["next"][0]["who"]) == ("fleet/blue", "the robot")
    assert [field["met"] for field in told["fields"]] == [False, False, True]


def test_explain_answers_for_the_time_of_to(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("explain", bag, "--to", "08:00:07") == 0
    assert "fleet/red has waited since 08:00:06" in capsys.readouterr().out


def test_explain_tells_the_story_from_the_time_of_from(
    bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("explain", bag, "--from", "+5") == 0
    told = capsys.readouterr().out
    assert "08:00:09.7  the door is open" in told
    assert "08:00:06.0" not in told


def test_another_session_is_asked_about(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("explain", bag, "--session", "fleet/red") == 0
    assert "What RMF checks for fleet/red:" in capsys.readouterr().out


def test_explain_gives_each_of_several_devices_a_line(
    tmp_path: Path, heard: list[Heard], capsys: pytest.CaptureFixture[str]
) -> None:
    states = [(one, one.message) for one in fire()[0]]
    renamed = [
        replace(one, message=replace(message, lift_name="B"))
        for one, message in states
        if isinstance(message, LiftState)
    ]
    bag = write(tmp_path / "bag", sorted([*heard, *renamed], key=lambda one: one.at), NEWEST)
    assert run("explain", bag) == 0
    told = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in told[:2]] == ["lift B", "lift Lift1"]


def test_a_device_that_was_not_heard_is_exit_1(
    bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("explain", bag, "Lift2") == 1
    told = capsys.readouterr().out
    assert told.startswith("device Lift2, heard from ")
    assert "(did you mean Lift1?)" in " ".join(told.split())


def test_a_recording_that_was_cut_is_explained_as_far_as_it_goes(
    tmp_path: Path, heard: list[Heard], capsys: pytest.CaptureFixture[str]
) -> None:
    whole = next(write(tmp_path / "bag", heard, NEWEST).glob("*.mcap"))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: -(whole.stat().st_size // 10)])
    assert run("explain", cut) in (0, 1)
    assert "only the part before this place is used" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ("explain",),
        ("explain", "a.mcap", "--live", "Lift1"),
        ("explain", "--live", "Lift1", "--for", "0"),
        ("explain", "a.mcap", "--from", "25:00"),
        ("explain", "a.mcap", "--from", "soon"),
        ("explain", "a.mcap", "--to", "2026-13-40 10:00"),
        ("plot", "a.mcap", "-o", "ride.gif"),
        ("plot", "a.mcap", "-o", "ride.svg", "--width", "10"),
        ("plot", "a.mcap"),
    ],
)
def test_a_wrong_command_line_is_exit_2(arguments: tuple[str, ...]) -> None:
    try:
        code = run(*arguments)
    except SystemExit as left:
        code = int(str(left.code))
    assert code == 2


@pytest.mark.parametrize("suffix", ["svg", "html", "png"])
def test_a_ride_is_drawn_in_each_format(suffix: str, bag: Path, tmp_path: Path) -> None:
    picture = tmp_path / f"ride.{suffix}"
    assert run("plot", bag, "--device", "Lift1", "-o", picture) == 0
    content = picture.read_bytes()
    if suffix == "png":
        assert content.startswith(PNG)
    else:
        assert b">fleet/red</text>" in content
        assert b"<script" not in content
    assert [file.name for file in tmp_path.glob("*ride*")] == [picture.name]


def test_the_page_has_the_sentences_too(bag: Path, tmp_path: Path) -> None:
    assert run("plot", bag, "-o", tmp_path / "ride.html") == 0
    assert "fleet/blue has waited since" in (tmp_path / "ride.html").read_text("utf-8")


def test_a_picture_that_cannot_be_written_is_exit_1(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("plot", bag, "-o", tmp_path / "missing" / "ride.svg") == 1
    assert "cannot be written: No such file or directory" in capsys.readouterr().err


def test_a_live_graph_is_heard_by_topic(heard: list[Heard]) -> None:
    network = MemoryNetwork()
    ear = live.Ear(MemoryTransport(network, "explain"))
    state = next(one.message for one in heard if one.topic == "lift_states")
    MemoryTransport(network, "lift").publisher(topics.LIFT_STATES).publish(state)
    assert [(one.topic, one.message) for one in ear.listen(0.0)] == [("lift_states", state)]


def test_explain_says_that_nothing_was_heard_live() -> None:
    site = HeardDevices("Lift1")
    site.pass_time(100.0, 1_800_000_000.0)
    site.pass_time(105.0, 1_800_000_005.0)
    assert site.explain("lift", "Lift1", None).now == ("Nothing at all was heard.",)


def test_what_is_proposed_live_names_the_graph_as_the_typed_command_did(
    domain: int, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--domain-id", str(domain), "--transport", wire(), "--localhost")
    assert run("explain", "--live", "Lift1", "--for", "0.1", *options) == 1
    told = " ".join(capsys.readouterr().out.split())
    assert f"`{' '.join(('rmf-bridge', 'doctor', 'FILE', *options))}`" in told


def test_diagnostics_that_only_count_on_are_taken_now_and_then() -> None:
    sieve = Sieve("Lift1")
    said = [b"\0\1\0\0stamp%3dLift1 age %d" % (n, n) for n in range(8)]
    kept = [sieve.keep("diagnostics", sample, float(at)) for at, sample in enumerate(said)]
    assert kept == [True, False, False, True, False, False, True, False]
    assert sieve.keep("diagnostics", b"\0\1\0\0stamp  9Lift1 FIRE", 7.1)


def test_of_other_devices_only_the_first_samples_are_taken() -> None:
    sieve = Sieve("Lift1")
    kept = [sieve.keep("door_states", b"ward", float(n)) for n in range(1000)]
    assert sum(kept) == FIRST_OF_OTHERS
    assert sieve.keep("lift_states", b"..Lift1..", 1.0)
    assert sieve.keep("door_supervisor_heartbeat", b"nobody", 1.0)
    assert not sieve.keep("rmf_bridge/entries", b"Lift1", 1.0)

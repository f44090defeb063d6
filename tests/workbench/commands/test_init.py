"""`rmf-bridge init`. Every draft passes `check`, and the command overwrites no file."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from yaml import safe_load

from bridges import cli
from bridges.settings.load import load
from tests.commands.terminal import Terminal
from workbench.commissioning.init import WIRINGS
from workbench.commissioning.init.gateway import PLACES

MAP = """
levels:
  Ground: {vertices: [[0, 0, 0, lobby]]}
  Ward 1: {vertices: []}
  Roof: {vertices: []}
lifts:
  East: {level_doors: {Ground: [east_g], Ward 1: [east_1]}}
"""


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the user's data directory. It contains the schema."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    return tmp_path / "data"


def combinations() -> Iterator[tuple[str, ...]]:
    for kind, wirings in WIRINGS.items():
        for wiring in wirings if kind != "fleet" else ():
            for encoding in (
                ("binary", "gray", "one_hot")
                if kind == "lift" and wiring not in ("gateway", "http")
                else ("",)
            ):
                yield (kind, wiring, encoding)


@pytest.mark.parametrize(("kind", "wiring", "encoding"), list(combinations()))
def test_each_draft_passes_check_and_the_schema_that_it_names(
    tmp_path: Path, kind: str, wiring: str, encoding: str
) -> None:
    file = tmp_path / "device.yaml"
    words = ["init", str(file), "--yes", "--kind", kind, "--wiring", wiring]
    assert cli.main(words + (["--encoding", encoding] if encoding else [])) == 0
    assert list(load(file).devices) == [f"{kind.capitalize()}1"]
    first, text = file.read_text().split("\n", 1)
    assert first.startswith("# yaml-language-server: $schema=")
    schema = json.loads(Path(first.partition("=")[2]).read_text())
    assert list(Draft202012Validator(schema).iter_errors(safe_load(text))) == []
    misspelt = safe_load(text) | {"busses": {}}
    assert list(Draft202012Validator(schema).iter_errors(misspelt)) != []


@pytest.mark.parametrize("wiring", ["http", "mqtt"])
def test_a_fleets_draft_has_its_robots_and_agrees_with_rmfs_files(
    wiring: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, config = tmp_path / "robots.yaml", Path("config").absolute()
    words = ["init", str(file), "--kind", "fleet", "--wiring", wiring, "--yes"]
    assert cli.main(words) == 64
    assert "config.yaml cannot be read" in capsys.readouterr().err
    words += ["--fleet-config", f"{config}/fleet_tiny.yaml"]
    words += ["--graph", f"{config}/fleet_tiny_graph.yaml"]
    assert cli.main(words) == 64
    assert "AMR02" in capsys.readouterr().err
    assert cli.main([*words, "--name", "AMR01, AMR02,AMR03"]) == 0
    assert list(load(file).devices) == ["AMR01", "AMR02", "AMR03"]
    assert cli.main(["check", str(file)]) == 0


def test_options_are_the_answers(tmp_path: Path) -> None:
    file = tmp_path / "device.yaml"
    words = "--kind lift --wiring modbus --address 10.0.0.7 --unit 3 --name no --floors G,1,2,3"
    words += " --signals fire_alarm,agv_mode,door_opened --domain-id 42 --yes"
    assert cli.main(["init", str(file), *words.split()]) == 0
    written = safe_load(file.read_text())
    assert (written["rmf"]["domain_id"], written["buses"]["module"]["tcp"]["host"]) == (
        42,
        "10.0.0.7",
    )
    lift = written["lifts"]["no"]
    assert lift["floors"] == ["G", "1", "2", "3"]
    assert lift["inputs"] == {
        "fire_alarm": {"point": "unit 3 discrete input 0", "active": "low"},
        "agv_mode": {"point": "unit 3 discrete input 1", "active": "high"},
        "door": {"point": "unit 3 discrete input 2", "active": "high", "proves": "open"},
    }
    assert list(load(file).devices) == ["no"]


def test_a_gateway_is_drafted_from_its_register_table(tmp_path: Path) -> None:
    file = tmp_path / "device.yaml"
    words = ["init", str(file), "--kind", "lift", "--wiring", "gateway", "--yes"]
    words += ["--floors", "G,1", "--address", "/dev/ttyS1", "--unit", "9", "--motion-at", "none"]
    words += ["--floor-at", "holding register 7", "--floor-numbers", "0,5"]
    words += ["--fire-alarm-at", "discrete input 4", "--request-at", "coil 2"]
    words += ["--no-call-number", "255"]  # 0 calls the car to G
    assert cli.main(words) == 0
    assert list(load(file).devices) == ["Lift1"]
    written = safe_load(file.read_text())
    assert written["driver"] == "register"
    assert written["buses"]["line"]["serial"]["port"] == "/dev/ttyS1"
    found = written["lifts"]["Lift1"]["map"]
    assert found["floor"] == {"at": "holding register 7", "codes": {0: "G", 5: "1"}}
    assert found["fire_alarm"] == {"at": "discrete input 4", "active": "high"}
    assert found["agv_mode"] == {"at": "input register 3", "bit": 0, "active": "high"}
    assert found["commands"]["agv_mode_request"]["at"] == "coil 2"
    assert found["commands"]["call"]["none"] == 255
    assert "motion" not in found


@pytest.mark.parametrize("floor_numbers", ["0,1,2", "1, 00, 2", "2,1,0"])
def test_no_number_for_no_call_is_guessed_if_0_is_a_floors_number(
    tmp_path: Path, floor_numbers: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "device.yaml"
    words = ["init", str(file), "--kind", "lift", "--wiring", "gateway", "--yes"]
    words += ["--floors", "G,1F,2F", "--floor-numbers", floor_numbers]
    assert cli.main(words) == 64
    assert capsys.readouterr().err == (
        f"rmf-bridge init: 0 is a floor's number ({floor_numbers}), so it cannot mean no call: give"
        " --no-call-number with the gateway's number for no call\n"
    )
    assert not file.exists()


def test_0_means_no_call_if_no_floor_has_this_number(tmp_path: Path) -> None:
    file = tmp_path / "device.yaml"
    words = ["init", str(file), "--kind", "lift", "--wiring", "gateway", "--yes"]
    assert cli.main([*words, "--floors", "1F,2F", "--floor-numbers", "1,10"]) == 0
    call = safe_load(file.read_text())["lifts"]["Lift1"]["map"]["commands"]["call"]
    assert call == {"at": "holding register 2", "codes": {1: "1F", 10: "2F"}, "none": 0}


@pytest.mark.parametrize("contacts", ["high", "low"])
@pytest.mark.parametrize("relays", ["high", "low"])
@pytest.mark.parametrize("kind", ["lift", "door", "charger", "alarm", "dispenser", "ingestor"])
def test_on_the_header_a_cut_wire_and_the_time_before_the_daemon_are_safe(
    tmp_path: Path, kind: str, contacts: str, relays: str
) -> None:
    file = tmp_path / "device.yaml"
    words = f"--kind {kind} --wiring gpio --contacts {contacts} --relays {relays} --yes"
    assert cli.main(["init", str(file), *words.split()]) == 0
    load(file)  # `load` refuses an unsafe draft, as `check` does


def test_a_map_gives_the_only_lift_and_its_floors(tmp_path: Path) -> None:
    site, file = tmp_path / "site.building.yaml", tmp_path / "device.yaml"
    site.write_text(MAP)
    assert cli.main(["init", str(file), "--kind", "lift", "--from", str(site), "--yes"]) == 0
    assert safe_load(file.read_text())["lifts"]["East"]["floors"] == ["Ground", "Ward 1"]


def test_an_existing_file_is_never_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "device.yaml"
    file.write_text("mine")
    assert cli.main(["init", str(file), "--kind", "door", "--yes"]) == 73
    assert cli.main(["init", str(file)]) == 73  # `init` refuses before its first question
    assert file.read_text() == "mine"


def test_a_missing_folder_is_reported_before_any_question_is_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "none" / "device.yaml"
    assert cli.main(["init", str(file)]) == 73
    assert capsys.readouterr().err == f"{file} cannot be written: No such file or directory\n"


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        ("--kind door", "there is no terminal for questions: give --name, or --yes for 'Door1'"),
        ("--kind door --floors L1 --yes", "--floors does not apply to a door on modbus"),
        (
            "--kind lift --wiring can --yes",
            "a lift cannot have the wiring can; choose one of: gpio",
        ),
        ("--kind door --graph x.yaml --yes", "--graph does not apply to a door on modbus"),
        ("--kind lift --floors L1 --yes", "a lift has at least two floors, each name once, not L1"),
        (
            "--kind lift --floors A,B,C,D,E,F,G,H,I,J,K --encoding one_hot --yes",
            "the header has too few free pins",
        ),
        ("--kind lift --signals fire --yes", "a lift has no input fire; its inputs are fire_alarm"),
        ("--kind door --unit 0 --yes", "unit is '0': write a whole number from 1 to 247"),
        ("--kind door --domain-id x --yes", "domain_id is 'x': write a whole number from 0 to 232"),
        (
            "--kind charger --wiring http --address x_y!:z --yes",
            "with these answers, `check` would",
        ),
        ("--kind door --wiring gateway --door-numbers 0,1 --yes", "door_numbers is '0,1': write"),
        ("--kind door --wiring gateway --door-numbers 0,0,1 --yes", "door_numbers is '0,0,1'"),
        ("--kind door --wiring gateway --floor-at x --yes", "--floor-at does not apply"),
        ("--kind lift --wiring gateway --encoding gray --yes", "--encoding does not apply"),
        (
            "--kind lift --wiring gateway --no-call-number 3 --yes",
            "no_call_number is '3': write one whole number that is no floor's number (1,2,3)",
        ),
        ("--kind lift --wiring gateway --no-call-number 4,5 --yes", "no_call_number is '4,5'"),
        ("--kind lift --wiring gateway --no-call-number off --yes", "no_call_number is 'off'"),
        (
            "--kind lift --wiring gateway --no-call-number 65536 --yes",
            "with these answers, `check`",
        ),
        (
            "--kind door --wiring gateway --no-call-number 0 --yes",
            "--no-call-number does not apply",
        ),
        ("--kind door --wiring gateway --hold-at 40001 --yes", "with these answers, `check` would"),
        ("--kind door --name= --yes", "'' is not a name for a door"),
    ],
)
def test_an_impossible_answer_is_reported_and_nothing_is_written(
    tmp_path: Path, words: str, answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "device.yaml"
    assert cli.main(["init", str(file), *words.split()]) == 64
    assert capsys.readouterr().err.startswith(f"rmf-bridge init: {answer}")
    assert not file.exists()


def test_a_file_that_is_not_a_map_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site.yaml"
    site.write_text("a: 1\n")
    assert cli.main(["init", str(tmp_path / "x.yaml"), "--from", str(site), "--yes"]) == 66
    assert "has no 'levels:'" in capsys.readouterr().err


def test_on_a_terminal_it_asks_one_thing_after_the_other(tmp_path: Path) -> None:
    file = tmp_path / "device.yaml"
    terminal = Terminal("init", str(file), "--domain-id", "5")
    terminal.wait_for("What is it?")
    terminal.type("\x1b[B\r")  # the down arrow selects the door
    terminal.wait_for("The device's name on RMF's map?")
    terminal.type("ward\r")
    terminal.wait_for("How is it wired?")
    terminal.type("\r")
    terminal.wait_for("The host")
    terminal.type("\r")
    terminal.wait_for("unit id?")
    terminal.type("\r")
    terminal.wait_for("is written")
    assert terminal.end() == 0
    assert list(load(file).devices) == ["ward"]
    assert load(file).rmf.domain_id == 5


def test_it_asks_for_the_number_for_no_call_without_an_offer_if_0_is_a_floors_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "device.yaml"
    given = {name.replace("_", "-"): place for name, (_, place) in PLACES.items()}
    given |= {"kind": "lift", "name": "East", "wiring": "gateway", "address": "127.0.0.1"}
    given |= {"unit": "1", "floors": "G,1F", "floor-numbers": "0,1", "domain-id": "0"}
    given |= {"door-numbers": "0,1,2", "motion-numbers": "0,1,2"}
    words = [word for option, value in given.items() for word in (f"--{option}", value)]
    assert cli.main(["init", str(file), *words]) == 64
    told = "there is no terminal for questions: give --no-call-number"
    assert capsys.readouterr().err == f"rmf-bridge init: {told}\n"
    terminal = Terminal("init", str(file), *words)
    terminal.wait_for("The number for no call?")
    terminal.type("9\r")
    terminal.wait_for("is written")
    assert terminal.end() == 0
    assert b"[]" not in terminal.screen
    call = safe_load(file.read_text())["lifts"]["East"]["map"]["commands"]["call"]
    assert call["none"] == 9


def test_ctrl_c_writes_nothing(tmp_path: Path) -> None:
    file = tmp_path / "device.yaml"
    terminal = Terminal("init", str(file))
    terminal.wait_for("What is it?")
    terminal.type("\x03")
    terminal.wait_for("nothing is written")
    assert terminal.end() == 130
    assert not file.exists()

"""A door on registers: the meaning of its numbers, its YAML and its profiles."""

import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st

from bridges.kinds.door.signals import DoorSample
from bridges.kinds.shared.decision import Sampled
from bridges.messages.definitions import DoorModeValue
from bridges.settings.load import SettingsError, load
from drivers.door.register import PROFILE, RegisterDoorSettings, decode, door_map, points, tables
from drivers.door.register_map import DoorMap
from drivers.hal.modbus.points import Point
from drivers.profiles.texts import FOLDER
from tests.depth import examples
from tests.kinds.door.virtual import CLOSED, CoreAlone
from tests.settings.reading import changed, problems_of

CONFIG = Path(__file__).parents[3] / "config"
GENERIC: DoorMap = PROFILE.load("generic-register-door")
QUIET = {"position": 255, "errors": 0, "obstruction": 0}
YAML = """\
kind: door
driver: register
buses:
  line: {type: modbus, tcp: {host: 10.0.0.1}}
doors:
  front:
    unit: 1
    map:
      status: {at: input register 0, closed: [0], moving: [1], open: [2], faults: {4: blocked}}
      command: {at: coil 0, hold: 1, release: 0}
"""
WORDS = st.integers(0, 65535)


def seen(**words: int) -> DoorSample:
    return decode(GENERIC, {**QUIET, **words})


def test_each_listed_status_is_what_the_map_says() -> None:
    samples = {status: seen(status=status) for status in range(4)}
    assert samples == {
        0: DoorSample(opened=False, closed=True, obstruction=False),
        1: DoorSample(opened=False, closed=False, obstruction=False),
        2: DoorSample(opened=True, closed=False, obstruction=False),
        3: DoorSample(opened=False, closed=False, obstruction=False),
    }


@pytest.mark.parametrize(
    ("words", "lost"),
    [
        ({"status": 4}, "status 4: blocked"),
        ({"status": 6}, "status 6 is not in the map"),
        ({"status": 65535}, "status 65535 is not in the map"),
        ({"status": 2, "position": 94}, "the status says open, but the position says not open"),
        ({"status": 0, "position": 6}, "the status says closed, but the position says not closed"),
        ({"status": 2, "position": 101}, "the position is not between 0 and 100"),
        ({"status": 1, "position": 65535}, "the position is not between 0 and 100"),
    ],
)
def test_a_contradictory_or_unlisted_status_is_neither_open_nor_closed(
    words: dict[str, int], lost: str
) -> None:
    assert seen(**words) == DoorSample(False, False, obstruction=False, lost=lost)


def test_a_position_within_its_limits_agrees() -> None:
    assert seen(status=2, position=95).opened
    assert seen(status=0, position=5).closed


def test_errors_are_texts_and_an_unlisted_bit_is_shown_by_its_number() -> None:
    found = seen(status=2, errors=0b1000_0000_0000_0101)
    assert found.errors == ("motor too hot", "on battery", "error bit 15")
    assert found.opened


def test_only_its_own_bit_means_an_obstruction() -> None:
    assert [seen(status=2, obstruction=word).obstruction for word in (0, 1, 2, 3)] == [
        False,
        True,
        False,
        True,
    ]


@tries(max_examples=examples(500))
@given(
    st.fixed_dictionaries(
        {
            "status": st.one_of(st.integers(0, 6), WORDS),
            "position": st.one_of(st.integers(0, 110), st.just(255), WORDS),
            "errors": WORDS,
            "obstruction": WORDS,
        }
    )
)
def test_no_register_value_raises_and_only_listed_ones_read_as_open(
    words: dict[str, int],
) -> None:
    sample = decode(GENERIC, words)
    says_open = words["status"] == 2 and (words["position"] in (*range(95, 101), 255))
    says_closed = words["status"] == 0 and (words["position"] in (*range(6), 255))
    assert (sample.opened, sample.closed) == (says_open, says_closed)
    assert bool(sample.lost) or words["status"] in range(4)


def test_a_lost_door_is_unknown_at_once_and_known_again_at_once() -> None:
    core = CoreAlone()
    core.sees(CLOSED, 1.0)
    lost = core.hears(Sampled(DoorSample(False, False, lost="status 9 is not in the map")))
    assert lost.report.mode is DoorModeValue.MODE_UNKNOWN
    assert core.faults() == ("DOOR_POSITION_UNKNOWN: status 9 is not in the map",)
    core.sees(DoorSample(False, False, lost="status 9 is not in the map"), 30.0)
    assert core.faults() == ("DOOR_POSITION_UNKNOWN: status 9 is not in the map",)
    core.sees(CLOSED, 31.0)
    assert core.told[-1][1] == "CLOSED"
    assert core.faults() == ()


def test_the_controllers_errors_are_one_fault_and_change_no_state() -> None:
    core = CoreAlone()
    decided = core.sees(DoorSample(False, True, errors=("motor too hot", "on battery")), 1.0)
    assert decided.report.mode is DoorModeValue.MODE_CLOSED
    assert core.faults() == ("DOOR_CONTROLLER_FAULT: motor too hot; on battery",)


def test_a_device_gives_the_unit_and_a_base_for_every_address() -> None:
    settings = msgspec.convert(
        {"unit": 3, "profile": "generic-register-door", "base_address": 100}, RegisterDoorSettings
    )
    assert points(settings) == {
        "status": Point(3, "input register", 100),
        "position": Point(3, "input register", 101),
        "errors": Point(3, "input register", 102),
        "obstruction": Point(3, "input register", 103),
        "command": Point(3, "holding register", 100),
    }


CHANGED: dict[str, dict[str, object]] = {
    "command": {"at": "coil 4", "hold": 0, "release": 1},
    "position": {"at": "input register 9"},
}


def test_a_device_may_change_parts_of_its_profiles_map() -> None:
    plain = {"unit": 1, "profile": "generic-register-door", "changes": CHANGED}
    changed = msgspec.convert(plain, RegisterDoorSettings)
    assert msgspec.to_builtins(door_map(changed)) == {
        **msgspec.to_builtins(GENERIC),
        "command": {**CHANGED["command"], "read_back": True},
        "position": {**CHANGED["position"], "unknown": None, "open_from": 95, "closed_to": 5},
    }
    assert points(changed)["command"] == Point(1, "coil", 4)


PROFILED = YAML[: YAML.index("    map:")] + "    profile: generic-register-door\n"


@pytest.mark.parametrize(
    ("changes", "wanted"),
    [
        ("{command: {at: coil 4, hold: 1, release: 0}}", []),
        ("{command: {at: coil 4, hold: 1}}", ["9:15: 'command' needs 'release'"]),
        (
            "{command: {at: coil 4, hold: 1, release: 1}}",
            ["9:55: 'release' is the value of hold too"],
        ),
        ("{commands: {at: coil 4}}", ["9:15: unknown key 'commands': did you mean 'command'?"]),
    ],
)
def test_a_devices_changes_are_judged_where_they_stand(
    tmp_path: Path, changes: str, wanted: list[str]
) -> None:
    found = problems_of(tmp_path / "door.yaml", f"{PROFILED}    changes: {changes}\n")
    assert [re.split(": a |known here", problem)[0].strip() for problem in found] == wanted


def test_a_map_that_is_written_out_has_no_changes_beside_it(tmp_path: Path) -> None:
    text = "    changes: {command: {at: coil 4, hold: 1, release: 0}}\n"
    assert problems_of(tmp_path / "door.yaml", YAML + text) == [
        "11:5: 'changes' is for a profile, but this device has a map: write the changes into the map"
    ]


def test_a_changed_command_is_claimed_and_its_warning_stands_where_it_is_changed(
    tmp_path: Path,
) -> None:
    path = tmp_path / "door.yaml"
    changes = "    changes: {command: {at: coil 4, hold: 1, release: 0, read_back: false}}\n"
    path.write_text(PROFILED + changes)
    assert [(w.line, w.column) for w in load(path).warnings] == [(4, 3), (9, 69)]
    second = PROFILED[PROFILED.index("  front:") :].replace("front", "back") + changes
    path.write_text(PROFILED + changes + second)
    text = r"unit 1 coil 4 is used by front changes\.command\.at on line 9"
    with pytest.raises(SettingsError, match=text):
        load(path)


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        ("unit: 1", "unit: 1", []),
        ("moving: [1]", "moving: [1, 2]", ["9:63: 'moving': 2 is listed under open already"]),
        ("{4: blocked}", "{0: blocked}", ["9:87: 'faults': 0 is listed under closed already"]),
        ("open: [2], ", "", ["9:7: 'status' needs 'open': a list ([...])"]),
        ("open: [2]", "open: []", ["9:64: 'open' has 0 entries: at least 1 are needed"]),
        (
            "at: input register 0",
            "at: coil 3",
            ["9:20: 'coil 3': write 'holding register 0' or 'input register 0'; addresses begin at 0"],
        ),
        (
            "at: input register 0",
            "at: input register 30001",
            [
                "9:20: 30001 looks like a manual's number, and these begin at 1: write input"
                " register 0. Write 0x7531 if 30001 really is the address on the wire"
            ],
        ),
        ("hold: 1, release: 0", "hold: 1, release: 1", ["10:47: 'release' is the value of hold too"]),
        ("hold: 1", "hold: 2", ["10:35: 'hold': a coil is 0 or 1"]),
        (
            "unit: 1",
            "unit: 1\n    profile: generic-register-door",
            ["8:14: 'profile': 'map' is given as well: delete one of the two"],
        ),
        (
            "unit: 1",
            "unit: 1\n    profile: generic-door",
            ["8:14: 'profile': 'map' is given as well: delete one of the two"],
        ),
        (
            "unit: 1",
            "unit: 1\n    base_address: 65535\n    feedback: estimated",
            [
                "9:15: the status gives the door's position: delete feedback",
                "6:3: 'front': feedback: estimated needs open_delay_s, the time the door takes to open",
            ],
        ),
        (
            "unit: 1",
            "unit: 1\n    on_fire: open",
            ["8:14: an operator on registers has no fire input: delete on_fire"],
        ),
    ],
)  # fmt: skip
def test_an_impossible_map_is_named_at_its_line(
    tmp_path: Path, old: str, new: str, wanted: list[str]
) -> None:
    assert sorted(problems_of(tmp_path / "door.yaml", changed(old, new, YAML))) == sorted(wanted)


def test_a_door_without_map_or_profile_is_told_which_profiles_there_are(tmp_path: Path) -> None:
    head = YAML[: YAML.index("    map:")]
    path = tmp_path / "door.yaml"
    path.write_text(head)
    with pytest.raises(SettingsError) as caught:
        load(path)
    assert str(caught.value).endswith("needs 'map', or a profile: generic-register-door")
    path.write_text(head + "    profile: generic-door\n")
    with pytest.raises(SettingsError, match=r":8:14: unknown profile 'generic-door': did you mean"):
        load(path)


def test_two_doors_never_share_a_command(tmp_path: Path) -> None:
    path = tmp_path / "door.yaml"
    second = YAML[YAML.index("  front:") :].replace("front", "back")
    path.write_text(YAML + second)
    with pytest.raises(SettingsError, match=r"unit 1 coil 0 is used by front map\.command\.at"):
        load(path)


def test_the_shipped_doors_are_sound() -> None:
    config = load(CONFIG / "door_register.yaml")
    assert [w.text.partition(" when ")[0] for w in config.warnings] == [
        "warning: bus 'line': units 1, 2 keep their outputs"
    ]
    assert list(config.devices) == ["ward_door", "lab_door"]


def test_a_problem_in_a_profile_has_its_file_line_and_column(tmp_path: Path) -> None:
    text = (FOLDER / "generic-register-door.yaml").read_text()
    broken = tmp_path / "generic-register-door.yaml"
    broken.write_text(text.replace("open: [2]", "opens: [2]"))
    with pytest.raises(SettingsError) as caught:
        PROFILE.load("generic-register-door", tmp_path)
    line = text[: text.index("open: [2]")].count("\n") + 1
    assert str(caught.value).startswith(
        f"{broken}:{line}:5: unknown key 'opens': did you mean 'open'?"
    )


def test_each_number_of_the_status_and_each_error_bit_is_a_row() -> None:
    status, errors = tables(load(CONFIG / "door_register.yaml").devices["ward_door"])
    assert status.rows == (
        ("closed", "0"),
        ("moving", "1"),
        ("open", "2"),
        ("moving", "3"),
        ("not known, with the fault: blocked", "4"),
        ("not known, with the fault: motor failure", "5"),
        ("not known, with a fault", "any other"),
    )
    assert errors.rows == (
        ("motor too hot", "0"),
        ("light curtain failed", "1"),
        ("on battery", "2"),
        ("an error, by its number", "any other"),
    )

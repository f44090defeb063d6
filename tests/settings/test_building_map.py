"""`rmf-bridge check FILE --building-map MAP` compares our names with RMF's. Maps have one of two
forms."""

import os
from pathlib import Path

import pytest

from bridges.cli import main
from bridges.settings.building_map import MAP, BuildingMap, load_map
from bridges.settings.load import SettingsError

BUILDING = """\
name: ward
coordinate_system: reference_image
levels:
  L1:
    doors:
      - [0, 1, {name: [1, ward_door], type: [1, sliding]}]
      - [1, 2, {name: [1, ""], type: [1, sliding]}]
    lanes:
      - [0, 1, {bidirectional: [4, true], graph_idx: [2, 0], orientation: [1, ""]}]
    vertices:
      - [1.5, 2, 0, pad_a, {is_charger: [4, true]}]
      - [3, 4, 0, pharmacy, {is_charger: [4, false]}]
      - [5, 6, 0, ""]
  L2: {vertices: []}
  L10: {elevation: 9}
lifts:
  Lift1:
    level_doors: {L1: [front], L2: [front], L10: []}
    doors: {front: {door_type: 2}}
"""

GRAPH = """\
building_name: ward
levels:
  L1:
    lanes:
    - [0, 1, {door_name: ward_door}]
    vertices:
    - [1.5, -2.0, {name: pad_a, is_charger: true, is_parking_spot: true}]
    - [3.0, -4.0, {name: pharmacy, is_charger: false}]
    - [0.0, 0.0, {name: '', lift: Lift1}]
  L2:
    lanes: []
    vertices:
    - [0.0, 0.0, {name: '', lift: Lift1}]
  L10: {lanes: [], vertices: []}
lifts: {Lift1: {position: [0.0, 0.0, 0.0], dims: [2.0, 2.0]}}
doors: {ward_door: {map: L1, endpoints: [[0.0, 0.0], [1.0, 0.0]]}}
"""

LIFT = """\
kind: lift
driver: dry_contact
buses: {header: {type: gpio}}
lifts:
  Lift1:
    floors: [L1, L2]
    inputs:
      fire_alarm: {point: "J8:7", active: low, pull: down}
      agv_mode: {point: "J8:13", active: high, pull: down}
      door: {point: "J8:35", active: high, pull: down, proves: open}
    floor_code:
      encoding: one_hot
      lines:
        L1: {point: "J8:29", active: high, pull: down}
        L2: {point: "J8:31", active: high, pull: down}
    outputs:
      agv_mode_request: {point: "J8:12", active: high}
      door_open: {point: "J8:36", active: high}
    calls:
      L1: {point: "J8:15", active: high}
      L2: {point: "J8:16", active: high}
"""

CHARGER = """\
kind: charger
driver: http
buses: {tpu: {type: http, api_base: "192.168.1.60/api"}}
chargers:
  pad_a: {codes: {idle: [0], charging: [5], error: [238]}}
"""

COORDINATOR = """\
kind: charger_coordinator
coordinator:
  stations:
    pad_a: {}
    b:
      waypoint: pharmacy
  fleets:
    tiny:
      waypoints: {pad_a: *at, wait: *at, pharmacy: *at}
      robots: {AMR01: {stations: [pad_a], waits_at: wait}}
""".replace("*at", "{level: L1, x: 1, y: 2}")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a folder with maps, so that a test types file names as a user does."""
    monkeypatch.chdir(tmp_path)
    Path("building.yaml").write_text(BUILDING)
    Path("graph.yaml").write_text(GRAPH)


def complaints(
    capsys: pytest.CaptureFixture[str], text: str, building: str = "building.yaml"
) -> list[str]:
    """Return the complaints of `check` about the names in this device YAML."""
    Path("device.yaml").write_text(text)
    code = main(["check", "-q", "device.yaml", "--building-map", building])
    said = capsys.readouterr().err.splitlines()
    assert code == (os.EX_CONFIG if said else 0)
    return said[:-1]


def problems_of(text: str | bytes) -> list[str]:
    """Return the reasons why a map cannot be read."""
    Path("map.yaml").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SettingsError) as caught:
        load_map("map.yaml")
    return [str(problem) for problem in caught.value.problems]


def test_a_building_map_is_read_down_to_its_names() -> None:
    assert load_map("building.yaml") == BuildingMap(
        "building.yaml",
        {
            "floor": {"L1": 4, "L2": 14, "L10": 15},
            "lift": {"Lift1": 17},
            "door": {"ward_door": 6},
            "charger": {"pad_a": 11},
            "waypoint": {"pad_a": 11, "pharmacy": 12},
        },
        {"Lift1": {"L1": 18, "L2": 18}},
    )


def test_a_navigation_graph_is_read_down_to_its_names() -> None:
    assert load_map("graph.yaml") == BuildingMap(
        "graph.yaml",
        {
            "floor": {"L1": 3, "L2": 10, "L10": 14},
            "lift": {"Lift1": 9},
            "door": {"ward_door": 5},
            "charger": {"pad_a": 7},
            "waypoint": {"pad_a": 7, "pharmacy": 8},
        },
        {"Lift1": {"L1": 3, "L2": 10}},
        {"pad_a": ("L1", 1.5, -2.0), "pharmacy": ("L1", 3.0, -4.0)},
    )


@pytest.mark.parametrize("building", ["building.yaml", "graph.yaml"])
@pytest.mark.parametrize("text", [LIFT, CHARGER])
def test_names_that_agree_cause_no_problem(
    capsys: pytest.CaptureFixture[str], text: str, building: str
) -> None:
    assert complaints(capsys, text, building) == []


def test_check_says_that_all_names_agree(capsys: pytest.CaptureFixture[str]) -> None:
    Path("device.yaml").write_text(LIFT)
    assert main(["check", "device.yaml", "--building-map", "graph.yaml"]) == 0
    assert "\nsame names as in graph.yaml: Lift1, L1, L2\n" in capsys.readouterr().out


def test_a_lift_that_the_map_spells_differently_is_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert complaints(capsys, LIFT.replace("Lift1", "lift_1")) == [
        "device.yaml:5:3: building.yaml has no lift 'lift_1': did you mean 'Lift1' (line 17)?"
    ]


def test_a_floor_without_a_level_of_that_name_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert complaints(capsys, LIFT.replace("L2", "Level2")) == [
        "device.yaml:6:5: on building.yaml (line 18) 'Lift1' also stops at 'L2': a robot sent there"
        " would always be refused. Add the floor, or remove the stop from the map",
        "device.yaml:6:18: the lift 'Lift1' does not stop at 'Level2' on building.yaml:"
        " it has L1, L2",
    ]


def test_a_level_where_the_lift_does_not_stop_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    said = complaints(capsys, LIFT.replace("L2", "L10"), "graph.yaml")
    assert said[1:] == [
        "device.yaml:6:18: the lift 'Lift1' does not stop at 'L10' on graph.yaml, though the map"
        " has that level (line 14)"
    ]


def test_floors_that_are_a_mapping_are_found_by_their_keys(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = LIFT.replace("[L1, L2]", "\n      L1: {}\n      B1: {level: L2}")
    assert complaints(capsys, text) == [
        "device.yaml:6:5: on building.yaml (line 18) 'Lift1' also stops at 'L2': a robot sent there"
        " would always be refused. Add the floor, or remove the stop from the map",
        "device.yaml:8:7: the lift 'Lift1' does not stop at 'B1' on building.yaml: it has L1, L2",
    ]


def test_a_charger_is_a_vertex_where_robots_charge(capsys: pytest.CaptureFixture[str]) -> None:
    assert complaints(capsys, CHARGER.replace("pad_a", "pharmacy")) == [
        "device.yaml:5:3: building.yaml:12: the waypoint 'pharmacy' is not a charger: set"
        " is_charger: true"
    ]
    assert complaints(capsys, CHARGER.replace("pad_a", "charger_9")) == [
        "device.yaml:5:3: building.yaml has no charger 'charger_9': it has pad_a"
    ]


def test_a_coordinators_waypoints_and_stations_stand_on_the_map(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert complaints(capsys, COORDINATOR) == [
        "device.yaml:6:7: building.yaml:12: the waypoint 'pharmacy' is not a charger: set"
        " is_charger: true",
        "device.yaml:9:51: building.yaml has no waypoint 'wait': it has pad_a, pharmacy",
    ]


def test_check_tells_that_a_map_has_no_lifts(capsys: pytest.CaptureFixture[str]) -> None:
    Path("flat.yaml").write_text("levels: {L1: {vertices: []}, L2: }\nlifts: {}\n")
    assert complaints(capsys, LIFT, "flat.yaml") == [
        "device.yaml:5:3: flat.yaml has no lift 'Lift1': it has none"
    ]


def test_check_tells_that_a_file_has_no_names_to_compare_with_a_map(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("device.yaml").write_text("kind: lift_supervisor\n")
    assert main(["check", "device.yaml", "--building-map", "building.yaml"]) == 0
    assert "\nthis file has no names to compare with building.yaml\n" in capsys.readouterr().out


def test_a_file_that_is_no_map_is_refused_at_the_wrong_place(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("device.yaml").write_text(LIFT)
    assert main(["check", "device.yaml", "--building-map", "device.yaml"]) == os.EX_CONFIG
    assert capsys.readouterr() == (
        "",
        "device.yaml:1:1: this is not a building map or navigation graph: it has no 'levels:'\n"
        "1 error\n",
    )


def test_each_value_of_a_wrong_form_is_named_with_its_place() -> None:
    text = (
        "levels:\n  L1:\n    vertices: 7\n    doors: {a: 1}\n  L2:\n    vertices: [8, [1, 2]]\n"
        "  [x]: {}\nlifts: [Lift1]\n"
    )
    assert problems_of(text) == [
        "map.yaml:3:15: 'vertices' must be a list, as RMF has it",
        "map.yaml:4:12: 'doors' must be a list, as RMF has it",
        "map.yaml:6:16: a vertex must be a list ([x, y, ...]), as RMF has it",
        "map.yaml:7:3: a name in 'levels' must be text",
        "map.yaml:8:8: 'lifts' must be a mapping (name: ...), as RMF has it",
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "map.yaml:1:1: the file is empty: begin it with 'levels: ...'"),
        ("- 1\n", "map.yaml:1:1: the file is not a mapping: begin it with 'levels: ...'"),
        (b"levels: \xff", "map.yaml:1:9: byte 0xff is not UTF-8: save the file as UTF-8"),
        ("levels: " + "[" * 40, "map.yaml:1:40: nested more than 32 deep"),
        ("levels: &a [*a]", "map.yaml:1:13: an alias ('*name') inside the value that it"),
        ("levels: !!python/name:os.system x", "map.yaml:1:9: a tag ('!...') is not acce"),
        (
            b" " * (MAP.max_bytes + 1),
            "map.yaml:1:1: longer than 1024 KiB: this is not a building map",
        ),
    ],
)
def test_a_hostile_file_ends_in_a_clear_text(text: str | bytes, problem: str) -> None:
    assert [said[: len(problem)] for said in problems_of(text)] == [problem]


def test_values_that_multiply_by_aliases_are_not_written_out() -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 8)]
    assert problems_of("\n".join(lines)) == [
        f"map.yaml:5:5: more than {MAP.max_values} values, counting repeated aliases"
    ]

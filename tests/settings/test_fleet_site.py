"""A fleet's YAML, and the two files of RMF that the YAML names. `check` finds each mistake that would
stop RMF's adapter."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from bridges.cli import main
from bridges.settings.fleet_site import limits_of, read_site
from bridges.settings.load import SettingsError, load
from bridges.settings.nav_graph import load_graph
from drivers.profiles import texts

FOLDER = Path(__file__).parents[2] / "config"
FILES = {
    name: (FOLDER / name).read_text()
    for name in ("robots_http.yaml", "fleet_tiny.yaml", "fleet_tiny_graph.yaml")
}
OURS, CONFIG, GRAPH = FILES
Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Return a function that writes the shipped files. Each change is a tuple (file, old text, new
    text)."""
    monkeypatch.setattr(texts, "_texts", {})

    def written(*changes: tuple[str, str, str]) -> Path:
        found = dict(FILES)
        for file, old, new in changes:
            assert found[file].count(old) == 1, old
            found[file] = found[file].replace(old, new)
        for name, text in found.items():
            (tmp_path / name).write_text(text)
        return tmp_path / OURS

    return written


def problems(file: Path) -> list[str]:
    try:
        read_site(load(file))
    except SettingsError as error:
        return [str(problem).removeprefix(f"{file.parent}/") for problem in error.problems]
    return []


def test_the_shipped_files_are_one_site(write: Write) -> None:
    file = write()
    site = read_site(load(file))
    assert site.graph.levels() == ["L1", "L2"]
    assert site.of("AMR02").charger == "wait_2"
    assert sorted(site.transforms) == ["L1", "L2"]
    vertex = site.graph.called("pharmacy")
    assert vertex
    at = site.of("AMR01").on_robots_map(vertex.pose())
    assert (round(at.x, 2), round(at.y, 2)) == (0.02, -7.98)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            (OURS, "  AMR03:", "  AMR04:"),
            [
                "fleet_tiny.yaml:29:5: robots_http.yaml has no robot 'AMR03': add it below robots:",
                "robots_http.yaml:25:3: fleet_tiny.yaml has an unknown robot 'AMR04': did you mean"
                " 'AMR03'? known here: AMR01, AMR02, AMR03",
            ],
        ),
        (
            (CONFIG, "AMR01: {charger: wait_1}", "AMR01: {charger: wait_9}"),
            [
                "fleet_tiny.yaml:27:13: the graph has no waypoint 'wait_9': did you mean 'wait_3'?"
                " known here: charger_a, dock_b, wait_1, wait_2, wait_3, pharmacy, lift_lobby,"
                " lift1_L1, lift1_L2, ward, ward_store"
            ],
        ),
        (
            (CONFIG, "AMR01: {charger: wait_1}", "AMR01: {}"),
            ["fleet_tiny.yaml:27:5: 'AMR01' has no charger: RMF's adapter does not add the robot"],
        ),
        (
            (CONFIG, "  mechanical_system: {mass: 20.0,", "  mechanical_system: {weight: 20.0,"),
            [
                "fleet_tiny.yaml:14:3: needs mechanical_system: mass, without which RMF's adapter does"
                " not start"
            ],
        ),
        (
            (CONFIG, "finishing_request: charge", "finishing_request: sleep"),
            [
                "fleet_tiny.yaml:23:3: unknown finishing_request 'sleep': known here: charge, park,"
                " nothing"
            ],
        ),
        (
            (CONFIG, "finishing_request: charge", "finishing_request: {type: sleep}"),
            [
                "fleet_tiny.yaml:23:3: unknown finishing_request 'sleep': known here: charge, park,"
                " nothing"
            ],
        ),
        (
            (
                CONFIG,
                "finishing_request: charge",
                "finishing_request: {type: park, waypoint_name: wait_1}",
            ),
            [
                "fleet_tiny.yaml:23:35: would send all robots to one place: write this waypoint below"
                " a robot"
            ],
        ),
        (
            (
                CONFIG,
                "{charger: wait_1}",
                "{charger: wait_1, finishing_request: {type: park, waypoint_name: wait_7}}",
            ),
            [
                "fleet_tiny.yaml:27:62: the graph has no waypoint 'wait_7': did you mean 'wait_3'?"
                " known here: charger_a, dock_b, wait_1, wait_2, wait_3, pharmacy, lift_lobby,"
                " lift1_L1, lift1_L2, ward, ward_store"
            ],
        ),
        *(
            (
                (
                    CONFIG,
                    "{charger: wait_1}",
                    f"{{charger: wait_1, finishing_request: {{type: {task}}}}}",
                ),
                [],
            )
            for task in ("park, waypoint_name: wait_2", "charge, waypoint_name: wait_7", "nothing")
        ),
        (
            (CONFIG, "lift_emergency_levels: {Lift1: L1}", "lift_emergency_levels: {Lift1: L7}"),
            ["fleet_tiny.yaml:22:27: unknown floor 'L7': known here: L1, L2"],
        ),
        (
            (CONFIG, "lift_emergency_levels: {Lift1: L1}", "lift_emergency_levels: {Lift: L1}"),
            ["fleet_tiny.yaml:22:27: unknown lift 'Lift': did you mean 'Lift1'? known here: Lift1"],
        ),
        (
            (CONFIG, "[6.98, -11.0]", "[16.98, -11.0]"),
            [
                "fleet_tiny.yaml:33:3: the pairs do not fit: they differ by 2.38 m on RMF's map;"
                " without pair 3 the others fit"
            ],
        ),
        (
            (
                CONFIG,
                "[[7.0, -5.0], [4.02, -5.01], [6.98, -11.0], [3.01, -10.98]]",
                "[[7.0, 5.0], [4.02, 5.01], [6.98, 11.0], [3.01, 10.98]]",
            ),
            [
                "fleet_tiny.yaml:33:3: the pairs do not fit: they differ by 6.14 m on RMF's map; the"
                " robots' map is the mirror image of RMF's: change the sign of each y of the robots'"
                " points, and write y_axis: down below units (HTTP)"
            ],
        ),
        (
            (OURS, "AMR02: {profile: rmf-demos}", "AMR02: {profile: rmf-demos, known_as: AMR03}"),
            [
                "robots_http.yaml:25:3: 'AMR03' is the robot 'AMR02' already: it would get two orders"
            ],
        ),
        (
            (CONFIG, "  L2:\n    rmf", "  L3:\n    rmf"),
            [
                "fleet_tiny.yaml:32:1: no pairs for L2: RMF cannot place a robot on that level",
                "fleet_tiny.yaml:36:3: unknown level 'L3': known here: L1, L2",
            ],
        ),
        *(
            (
                (CONFIG, "linear: [0.5, 0.75]", f"linear: [0.5, {number}]"),
                ["fleet_tiny.yaml:9:5: is not possible for a robot: RMF's planner would fail"],
            )
            for number in (".nan", ".inf", "0", "-0.75")
        ),
        (
            (CONFIG, "tool_system: {power: 0.0}", "tool_system: {power: -1}"),
            ["fleet_tiny.yaml:16:17: is not possible for a robot: RMF's planner would fail"],
        ),
        (
            (OURS, "AMR02: {profile: rmf-demos}", "AMR02: {profile: rmf-demos, maps: {L9: a}}"),
            ["robots_http.yaml:24:38: unknown level 'L9': known here: L1, L2"],
        ),
        (
            (
                CONFIG,
                "finishing_request: charge",
                "actions: [clean, sweep]\n  finishing_request: park",
            ),
            [
                f"robots_http.yaml:{line}:3: fleet_tiny.yaml has the action 'sweep': write below"
                " actions: how it is started"
                for line in (23, 24, 25)
            ],
        ),
        (
            (OURS, "fleet:\n", "fleet:\n  control: traffic_light\n"),
            [
                f"robots_http.yaml:{line}:3: control: traffic_light needs pause, resume, fields: path"
                " in the interface"
                for line in (24, 25, 26)
            ],
        ),
        (
            (GRAPH, "name: wait_2", "name: wait_1"),
            [
                "fleet_tiny_graph.yaml:10:9: a second waypoint 'wait_1': RMF's adapter would end with"
                " an error"
            ],
        ),
        (
            (GRAPH, "- [11, 10, {}]", "- [12, 10, {}]"),
            [
                "fleet_tiny_graph.yaml:41:9: joins vertices 12 and 10, but 'L1' has 12 vertices,"
                " numbered from 0"
            ],
        ),
        (
            (GRAPH, "lifts:\n  Lift1:", "lifts:\n  LiftA:"),
            [
                "fleet_tiny_graph.yaml:18:9: the lift 'Lift1' is not below 'lifts': RMF's adapter would"
                " end with an error",
                "fleet_tiny_graph.yaml:44:9: the lift 'Lift1' is not below 'lifts': RMF's adapter would"
                " end with an error",
            ],
        ),
        (
            (GRAPH, "- [0, 5, {}]", "- [0, 5, {orientation_constraint: sideways}]"),
            [
                "fleet_tiny_graph.yaml:20:9: orientation_constraint is forward or backward, not"
                " sideways"
            ],
        ),
        (
            (GRAPH, "- [7.0, 9.0, {name: pharmacy}]", "- [7.0, .nan, {name: pharmacy}]"),
            ["fleet_tiny_graph.yaml:16:9: its x or y is no number"],
        ),
    ],
)
def test_a_mistake_is_reported_with_its_place(
    write: Write, change: tuple[str, str, str], says: list[str]
) -> None:
    assert problems(write(change)) == says


def test_a_missing_file_is_reported_at_the_key_that_names_it(write: Write) -> None:
    file = write((OURS, "config: fleet_tiny.yaml ", "config: fleet_huge.yaml "))
    said = problems(file)
    assert said[-1].endswith("fleet_huge.yaml cannot be read")
    assert said[-1].startswith("robots_http.yaml:12:3: ")


def test_a_building_map_is_no_graph(write: Write) -> None:
    file = write(
        (GRAPH, "[10.0, 2.0, {name: charger_a", "[10.0, 2.0, 0.0, charger_a, {x: 1, name: a")
    )
    assert "is not one" in problems(file)[0]


ONE = (
    "RMF's adapter does not read this form: below rmf_fleet: robots write"
    " 'AMR01: {charger: wait_1}'"
)


@pytest.mark.parametrize(
    ("form", "says", "light"),
    [
        ("{rmf_config: {charger: {waypoint: wait_1}}}", f"27:36: {ONE}", False),
        ("{charger: {waypoint: wait_1}}", f"27:23: {ONE}", True),
    ],
)
def test_a_form_that_rmf_does_not_read_is_refused_with_the_line_to_write(
    write: Write, form: str, says: str, light: bool
) -> None:
    changes = [(CONFIG, "AMR01: {charger: wait_1}", f"AMR01: {form}")]
    assert problems(write(*changes)) == [f"fleet_tiny.yaml:{says}"]
    texts._texts.clear()
    ours = (Path(__file__).parents[2] / "config" / "robots_traffic_light.yaml").read_text()
    file = write(*changes).with_name("light.yaml")
    file.write_text(ours)
    assert (problems(file) != []) is light, "RMF throws, whatever the control is"


def test_robots_beside_rmf_fleet_are_refused(write: Write) -> None:
    file = write()
    text = FILES[CONFIG]
    robots = text[text.index("  robots:\n") : text.index("# The same points")]
    beside = "".join(line.removeprefix("  ") for line in robots.splitlines(keepends=True))
    file.with_name(CONFIG).write_text(text.replace(robots, beside))
    assert problems(file)[0].endswith(f"{ONE}")
    texts._texts.clear()
    file.with_name(CONFIG).write_text(text + beside)
    assert problems(file) == [], "RMF reads the robots below rmf_fleet"


def test_the_demos_form_of_coordinates_is_read(write: Write) -> None:
    older = write()
    text = FILES[CONFIG]
    pairs = "{rmf: [[0, 0], [1, 0]], robot: [[5, 5], [5, 6]]}"
    pairs = f"\nfleet_manager:\n  reference_coordinates: {pairs}\n"
    older.with_name(CONFIG).write_text(text[: text.index("# The same points")] + pairs)
    texts._texts.clear()
    site = read_site(load(older))
    assert [round(t.rotation, 4) for t in site.transforms.values()] == [1.5708]


def test_transforms_of_rmf_are_read_and_need_no_repetition(write: Write) -> None:
    line = "  finishing_request: charge"
    own = "  transforms: {L1: {translation: [1, 2], rotation: 0.5}, L2: {scale: 2.0}}"
    file = write((CONFIG, line, f"{own}\n{line}"))
    text = file.with_name(CONFIG).read_text()
    file.with_name(CONFIG).write_text(text[: text.index("# The same points")])
    site = read_site(load(file))
    assert site.estimated == ()
    found = site.transforms["L1"]
    assert (round(found.rotation, 3), found.shift) == (0.5, 1 + 2j)


def test_the_limits_of_a_robot_include_its_site(write: Write) -> None:
    limits = limits_of(load(write()), "AMR01", {})
    assert limits.site.graph.called("pharmacy")
    assert limits.t.stale_after_s == 5.0


def test_check_reads_the_files_and_prints_the_transforms(
    write: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(write())]) == 0
    said = capsys.readouterr().out
    assert "fleet_tiny.yaml: the robots' map for L1 is RMF's map, turned by 1.5683 rad" in said
    silent = ("lie on one line", "no lane", "have the charger", "does not read")
    assert not any(text in said for text in silent)
    texts._texts.clear()
    fewer = ("[[7.0, -3.0], [7.0, -1.0], [7.0, 3.0], [9.0, 3.0]]", "[[7.0, -3.0], [7.0, 3.0]]")
    theirs = (
        "[[12.0, -8.0], [10.0, -8.0], [6.0, -8.0], [6.0, -6.0]]",
        "[[12.0, -8.0], [6.0, -8.0]]",
    )
    shared = (CONFIG, "AMR02: {charger: wait_2}", "AMR02: {charger: wait_1}")
    cut = (GRAPH, "      - [8, 9, {}]\n", "")
    assert main(["check", str(write((CONFIG, *fewer), (CONFIG, *theirs), shared, cut))]) == 0
    said = capsys.readouterr().out
    assert "the pairs for L2 lie on one line" in said
    assert "no lane leads to 'pharmacy', so RMF sends no robot there" in said
    assert "2 robots have the charger 'wait_1': all drive there" in said
    texts._texts.clear()
    own = (CONFIG, "  reversible: true", "  reversable: true\n  colour: blue")
    misspelt = (
        CONFIG,
        "AMR03: {charger: wait_3}",
        "AMR03: {charger: wait_3, responsive_wiat: true}",
    )
    assert main(["check", str(write(own, misspelt))]) == 0
    said = " ".join(capsys.readouterr().out.split())
    where = "fleet_tiny.yaml"
    knows = "RMF's adapter does not read"
    assert f"{where}:12:3: {knows} 'reversable': did you mean 'reversible'?" in said
    assert f"{where}:30:30: {knows} 'responsive_wiat': did you mean 'responsive_wait'?" in said
    assert said.count(knows) == 2
    texts._texts.clear()
    spoilt = write((CONFIG, "charger: wait_1", "charger: wait_9"))
    assert main(["check", str(spoilt)]) == os.EX_CONFIG
    assert "the graph has no waypoint 'wait_9'" in capsys.readouterr().err


def test_check_compares_fleet_coordinator_and_lifts_as_one_site(
    write: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write((CONFIG, "recharge_threshold: 0.20", "recharge_threshold: 0.95"))
    others = [str(FOLDER / name) for name in ("charger_coordinator.yaml", "lift_dry_contact.yaml")]
    assert main(["check", "-q", str(file), *others]) == os.EX_CONFIG
    said = capsys.readouterr().err
    assert "write again_percent above 95" in said
    assert "the lift 'Lift1' does not stop at 'L3' on fleet_tiny_graph.yaml" in said


def test_a_graph_of_an_older_editor_has_no_lists_of_lifts_and_doors(tmp_path: Path) -> None:
    file = tmp_path / "graph.yaml"
    file.write_text("levels: {L1: {vertices: [[0, 0, {name: a, lift: Lift1}]], lanes: []}}")
    assert load_graph(str(file)).vertices[0].lift == "Lift1"

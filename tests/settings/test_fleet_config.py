"""`check COORDINATOR --fleet-config CONFIG` prints each mismatch with file, line and remedy."""

import cmath
import math
import os
from pathlib import Path

import pytest

from bridges.cli import main
from bridges.kinds.shared.similarity import Point, estimate, odd_pair
from bridges.settings.fleet_config import load_fleet
from bridges.settings.load import SettingsError

OURS = """\
kind: charger_coordinator
coordinator:
  stations: {charger_a: {}, charger_b: {waypoint: dock_b}}
  fleets:
    tiny:
      waypoints:
        charger_a: {level: L1, x: 10, y: 2}
        dock_b: {level: L1, x: 10, y: 5}
        wait_1: {level: L1, x: 4, y: 2}
        wait_2: {level: L1, x: 4, y: 6}
      robots:
        AMR01: {stations: [charger_a, charger_b], waits_at: wait_1}
        AMR02: {stations: [charger_b, charger_a], waits_at: wait_2}
"""
THEIRS = """\
rmf_fleet:
  name: tiny
  recharge_threshold: 0.2
  recharge_soc: 1.0
  finishing_request: park
  robots:
    AMR01: {charger: charger_a}
    AMR02: {charger: dock_b}
reference_coordinates:
  L1:
    rmf: [[10, 2], [10, 5], [4, 2], [4, 6]]
    robot: [[7, -5], [4, -5], [7, -11], [3, -11]]
"""
GRAPH = """\
levels:
  L1:
    lanes: []
    vertices:
    - [10.2, 2.1, {name: charger_a, is_charger: true}]
    - [10.0, 5.0, {name: dock_b, is_charger: true}]
    - [4.0, 2.0, {name: wait_1}]
    - [4.0, 6.0, {name: wait_2}]
"""


class Site:
    """The coordinator's file and RMF's fleet config. A test may add RMF's navigation graph."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self._folder, self._capsys = folder, capsys

    def check(
        self, ours: str = OURS, theirs: str = THEIRS, graph: str = "", *more: str
    ) -> tuple[int, list[str]]:
        """Return the exit code, and each problem and warning without its folder."""
        for name, text in (("ours.yaml", ours), ("config.yaml", theirs), ("graph.yaml", graph)):
            (self._folder / name).write_text(text)
        options = ["--building-map", str(self._folder / "graph.yaml")] if graph else []
        files = [
            str(self._folder / "ours.yaml"),
            "--fleet-config",
            str(self._folder / "config.yaml"),
        ]
        code = main(["check", *files, *options, *more])
        self.out, err = self._capsys.readouterr()
        lines = [line.removeprefix(f"{self._folder}/") for line in err.splitlines()]
        return code, [line for line in lines if ".yaml:" in line]


@pytest.fixture
def site(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Site:
    monkeypatch.setenv("COLUMNS", "200")
    return Site(tmp_path, capsys)


def test_files_that_agree_give_no_problem_and_the_error_of_the_transform_is_reported(
    site: Site,
) -> None:
    assert site.check() == (0, [])
    assert (
        "config.yaml: transformation error estimate for L1: 0"
        " (turned by 1.5708 rad, scaled by 1, error 0.00 m on RMF's map)" in site.out
    )


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "name: tiny",
            "name: tinny",
            "config.yaml:2:3: ours.yaml has an unknown fleet 'tinny': did you mean 'tiny'?"
            " known here: tiny",
        ),
        (
            "    AMR02: {charger: dock_b}\n",
            "    AMR2: {charger: dock_b}\n",
            "ours.yaml:13:9: config.yaml has an unknown robot 'AMR02': did you mean 'AMR2'?"
            " known here: AMR01, AMR2",
        ),
        (
            "AMR02: {charger: dock_b}",
            "AMR02: {charger: dok_b}",
            "config.yaml:8:13: ours.yaml has an unknown waypoint 'dok_b': did you mean 'dock_b'?"
            " known here: charger_a, dock_b, wait_1, wait_2",
        ),
        (
            "AMR02: {charger: dock_b}",
            "AMR02: {charger: charger_a}",
            "config.yaml:8:13: 'charger_a' is the charger of 'AMR01' too: RMF would send both robots"
            " there",
        ),
        (
            "AMR02: {charger: dock_b}",
            "AMR02: {}",
            "config.yaml:8:5: 'AMR02' has no charger: RMF never sends this robot to charge",
        ),
        (
            "recharge_threshold: 0.2",
            "recharge_threshold: 0.9",
            "config.yaml:3:3: below recharge_threshold 90 % RMF gives a robot no task, but the"
            " coordinator charges it again only below again_percent 90 %: write again_percent above"
            " 90",
        ),
        (
            "finishing_request: park",
            "finishing_request: dance",
            "config.yaml:5:3: unknown finishing_request 'dance': known here: charge, park, nothing",
        ),
        (
            "robot: [[7, -5], [4, -5], [7, -11], [3, -11]]",
            "robot: [[7, -5], [4, -5], [7, -11], [30, -11]]",
            "config.yaml:10:3: the pairs do not fit: they differ by 5.46 m on RMF's map, but near_m is"
            " 1 m: a robot would not be seen at its waypoint; without pair 4 the others fit",
        ),
        (
            "robot: [[7, -5], [4, -5], [7, -11], [3, -11]]",
            "robot: [[7, 5], [4, 5], [7, 11], [3, 11]]",
            "config.yaml:10:3: one map is the other's mirror image: change the sign of every robot's y",
        ),
        (
            "robot: [[7, -5], [4, -5], [7, -11], [3, -11]]",
            "robot: [[7, -5], [4, -5]]",
            "config.yaml:10:3: 4 points and 2 points do not make pairs",
        ),
    ],
)
def test_contradictory_settings_are_named_at_their_place(
    site: Site, old: str, new: str, problem: str
) -> None:
    assert THEIRS.count(old) == 1
    code, found = site.check(theirs=THEIRS.replace(old, new))
    assert (code, problem in found) == (os.EX_CONFIG, True), found


@pytest.mark.parametrize(
    ("key", "problem"),
    [
        (
            "publish_fleet_state: 0.2",
            "config.yaml:3:3: 0.2 Hz is too seldom for the coordinator to see the robots: write 1 or"
            " more",
        ),
        (
            "account_for_battery_drain: False",
            "config.yaml:3:3: with false, RMF never sends a robot to charge: write true",
        ),
    ],
)
def test_a_key_without_which_no_robot_is_charged_is_an_error(
    site: Site, key: str, problem: str
) -> None:
    theirs = THEIRS.replace("  name: tiny\n", f"  name: tiny\n  {key}\n")
    assert site.check(theirs=theirs) == (os.EX_CONFIG, [problem])


@pytest.mark.parametrize(
    ("levels", "code", "begins"),
    [
        ("{Lift1: L1}", 0, []),
        (
            "{Lift2: L1}",
            0,
            ["warning: 'Lift1' raises an alarm (emergency_signal) and has no recall"],
        ),
        ("{Lift1: L9}", os.EX_CONFIG, ["'Lift1' has an unknown floor 'L9'"]),
    ],
)
def test_a_lift_with_an_alarm_needs_a_recall_floor_in_the_fleet_configuration(
    site: Site, levels: str, code: int, begins: list[str]
) -> None:
    lift = (Path(__file__).parents[2] / "config" / "lift_io_module.yaml").read_text()
    lift += "    alarm: emergency_signal\n"
    theirs = THEIRS.replace("  name: tiny\n", f"  name: tiny\n  lift_emergency_levels: {levels}\n")
    found, told = site.check(lift, theirs)
    told = [line.partition("config.yaml:3:")[2].partition(": ")[2] for line in told]
    assert found == code
    assert [
        line[: len(text)] for line, text in zip(filter(None, told), begins, strict=True)
    ] == begins


def test_a_station_that_releases_a_robot_before_rmfs_recharge_soc_is_a_mismatch(site: Site) -> None:
    code, found = site.check(ours=OURS + "  full_percent: 95\n")
    assert (code, found) == (
        78,
        [
            "config.yaml:4:3: a station releases a robot at full_percent 95 %, but the robot"
            " waits there for recharge_soc 100 %: write recharge_soc: 0.95, or less"
        ],
    )


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        (
            "recharge_soc: 1.0",
            "recharge_soc: 0.9",
            "config.yaml:4:3: warning: RMF's task ends at recharge_soc 90 %, and the robot keeps its"
            " station until full_percent 100 %: write full_percent: 90",
        ),
        (
            "  finishing_request: park",
            "  finishing_request: nothing",
            "config.yaml:5:3: warning: if finishing_request is 'nothing' or missing, a charged robot"
            " stays on its pad until it gets a task, and the next robot waits: write finishing_request"
            " 'charge'",
        ),
        (
            "  finishing_request: park\n",
            "",
            "config.yaml:1:1: warning: if finishing_request is 'nothing' or missing, a charged robot"
            " stays on its pad until it gets a task, and the next robot waits: write finishing_request"
            " 'charge'",
        ),
        (
            "AMR02: {charger: dock_b}",
            "AMR02: {charger: dock_b, finishing_request: {type: nothing}}",
            "config.yaml:8:30: warning: if finishing_request is 'nothing' or missing, a charged robot"
            " stays on its pad until it gets a task, and the next robot waits: write finishing_request"
            " 'charge'",
        ),
        (
            "    AMR02: {charger: dock_b}\n",
            "    AMR02: {charger: dock_b}\n    AMR03: {charger: wait_1}\n",
            "config.yaml:9:5: warning: no station of ours charges 'AMR03'",
        ),
        (
            "AMR02: {charger: dock_b}",
            "AMR02: {charger: wait_1}",
            "config.yaml:8:13: warning: 'AMR02' charges or waits at dock_b, charger_a, wait_2, but"
            " RMF first drives it to 'wait_1'",
        ),
        (
            "  L1:\n",
            "  L2:\n",
            "config.yaml:9:1: warning: no pairs for level 'L1', where this fleet has waypoints",
        ),
    ],
)
def test_a_likely_mistake_gives_a_warning(site: Site, old: str, new: str, warning: str) -> None:
    assert THEIRS.count(old) == 1
    assert site.check(theirs=THEIRS.replace(old, new)) == (0, [warning])


def test_a_robots_own_finishing_request_takes_the_place_of_the_fleets(site: Site) -> None:
    none = THEIRS.replace("  finishing_request: park\n", "")
    own = none.replace("charger_a}", "charger_a, finishing_request: charge}")
    assert site.check(theirs=own)[1]  # the other robot has none
    own = own.replace("dock_b}", "dock_b, finishing_request: {type: charge}}")
    assert site.check(theirs=own) == (0, [])


def test_the_older_form_of_the_file_says_the_same(site: Site) -> None:
    head, _, pairs = THEIRS.partition("  robots:\n")
    rmf, robot = (line.strip() for line in pairs.splitlines()[-2:])
    older = f"""\
{head}robots:
  AMR01: {{rmf_config: {{charger: {{waypoint: charger_a}}}}}}
  AMR02: {{rmf_config: {{charger: {{waypoint: dok_b}}}}}}
reference_coordinates:
  {rmf}
  {robot}
"""
    code, found = site.check(theirs=older)
    assert code == os.EX_CONFIG
    assert [line.split(": ")[0] for line in found] == ["config.yaml:8:34"]
    code, found = site.check(theirs=older.replace("dok_b", "dock_b"))
    assert (code, found) == (0, [])
    assert "config.yaml: transformation error estimate: 0 (" in site.out


def test_waypoints_are_compared_with_the_navigation_graph(site: Site) -> None:
    assert site.check(OURS, THEIRS, GRAPH) == (0, [])
    code, found = site.check(OURS.replace("x: 10, y: 5", "x: 10, y: 7"), THEIRS, GRAPH)
    assert (code, found) == (
        78,
        ["ours.yaml:8:9: graph.yaml:6 has 'dock_b' at x 10, y 5: 2.00 m away, near_m is 1"],
    )


def test_a_waypoint_in_coordinates_of_the_robot_is_named_with_those_of_rmf(site: Site) -> None:
    code, found = site.check(OURS.replace("x: 10, y: 5", "x: 4, y: -5"), THEIRS, GRAPH)
    text = "this place is on the robot's map; on RMF's map write x: 10, y: 5 (graph.yaml:6)"
    assert (code, found) == (os.EX_CONFIG, [f"ours.yaml:8:9: {text}"])


def test_a_waypoint_on_another_level_is_named(site: Site) -> None:
    code, found = site.check(
        OURS.replace("dock_b: {level: L1", "dock_b: {level: L2"), THEIRS, GRAPH
    )
    assert code == os.EX_CONFIG
    assert "ours.yaml:8:18: graph.yaml:6 has 'dock_b' on level 'L1'" in found


def test_a_file_that_is_not_a_fleet_configuration_is_refused_with_its_line(site: Site) -> None:
    code, found = site.check(theirs="rmf_fleet:\n  name: tiny\n  recharge_soc: 80\n")
    assert (code, found) == (
        78,
        [
            "config.yaml:3:3: expected `float` <= 1.0: is this a fleet adapter's configuration?",
        ],
    )
    code, found = site.check(theirs="levels: {}\n")
    text = "object missing required field `rmf_fleet`: is this a fleet adapter's configuration?"
    assert (code, found) == (os.EX_CONFIG, [f"config.yaml:1:1: {text}"])


def test_a_fleet_configuration_without_a_coordinator_is_compared_with_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    theirs = tmp_path / "config.yaml"
    theirs.write_text(THEIRS)
    assert (
        main(["check", "-q", "config/door_modbus.yaml", "--fleet-config", str(theirs)])
        == os.EX_CONFIG
    )
    assert (
        "YAMLs of a charger coordinator or lifts, and no such YAML is given"
        in capsys.readouterr().err
    )


def test_the_shipped_fleet_agrees_with_the_shipped_coordinator(
    capsys: pytest.CaptureFixture[str],
) -> None:
    files = ["config/charger_coordinator.yaml", "--fleet-config", "config/fleet_tiny.yaml"]
    assert main(["check", "-q", *files]) == 0
    assert capsys.readouterr().err == ""


# --- the transform -----------------------------------------------------------------------------


def test_the_transform_of_the_adapter_template_example_has_the_expected_error() -> None:
    """The points come from config.yaml of open-rmf/fleet_adapter_template. The expected values come
    from nudged 0.3.1."""
    rmf = [(20.33, -3.156), (8.908, -2.57), (13.02, -3.601), (21.93, -4.124)]
    robot = [(59.0, 399.0), (57.0, 172.0), (68.0, 251.0), (75.0, 429.0)]
    found = estimate(rmf, robot)
    sums = _nudged(rmf, robot)
    assert math.isclose(found.turn.real, sums[0])
    assert math.isclose(found.turn.imag, sums[1])
    assert math.isclose(found.shift.real, sums[2])
    assert math.isclose(found.shift.imag, sums[3])


def _nudged(x: list[tuple[float, float]], y: list[tuple[float, float]]) -> tuple[float, ...]:
    """Return (s, r, x, y), computed by least squares. s and r are scale times cosine and scale times
    sine of the rotation. x and y are the translation."""
    n = len(x)
    a1, b1 = sum(p[0] for p in x), sum(p[1] for p in x)
    c1, d1 = sum(p[0] for p in y), sum(p[1] for p in y)
    a2, b2 = sum(p[0] ** 2 for p in x), sum(p[1] ** 2 for p in x)
    ac = sum(p[0] * q[0] for p, q in zip(x, y, strict=True))
    ad = sum(p[0] * q[1] for p, q in zip(x, y, strict=True))
    bc = sum(p[1] * q[0] for p, q in zip(x, y, strict=True))
    bd = sum(p[1] * q[1] for p, q in zip(x, y, strict=True))
    den = n * a2 + n * b2 - a1 * a1 - b1 * b1
    s = (n * (ac + bd) - a1 * c1 - b1 * d1) / den
    r = (n * (ad - bc) + b1 * c1 - a1 * d1) / den
    return s, r, (c1 - s * a1 + r * b1) / n, (d1 - s * b1 - r * a1) / n


def test_a_known_transform_is_found_and_undone() -> None:
    rmf = [(0.0, 0.0), (1.0, 0.0), (0.0, 2.0)]
    robot = [(5.0, 5.0), (5.0, 7.0), (1.0, 5.0)]  # turned by 90 degrees, scaled by 2, shifted
    found = estimate(rmf, robot)
    assert cmath.isclose(found.turn, 2j, abs_tol=1e-12)
    assert cmath.isclose(found.shift, 5 + 5j, abs_tol=1e-12)
    assert round(found.rotation, 6) == 1.570796
    assert (round(found.scale, 9), round(found.error, 9)) == (2.0, 0.0)
    assert math.dist(found.back((1.0, 5.0)), (0.0, 2.0)) < 1e-12


def test_the_error_is_a_mean_square_and_is_shown_in_metres_as_its_root() -> None:
    found = estimate([(0.0, 0.0), (2.0, 0.0), (0.0, 0.0)], [(0.0, 2.0), (4.0, 0.0), (0.0, -2.0)])
    assert (round(found.mse, 9), round(found.error, 9)) == (
        round(8 / 3, 9),
        round((8 / 3) ** 0.5 / 2, 9),
    )


@pytest.mark.parametrize(
    ("pairs", "reason"),
    [
        (([(0.0, 0.0)], [(1.0, 1.0)]), "two pairs at least"),
        (([(0.0, 0.0), (0.0, 0.0)], [(1.0, 1.0), (2.0, 2.0)]), "all the same"),
        (([(0.0, 0.0), (1.0, 0.0)], [(1.0, 1.0), (1.0, 1.0)]), "all the same"),
    ],
)
def test_points_that_define_no_transform_are_refused(
    pairs: tuple[list[Point], list[Point]], reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        estimate(*pairs)


def test_a_file_that_cannot_be_read_is_a_problem_of_that_file(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="cannot be read: No such file"):
        load_fleet(str(tmp_path / "none.yaml"))


def test_a_pair_is_named_only_if_the_others_fit_without_it_alone() -> None:
    these = [(0.0, 0.0), (10.0, 0.0), (0.0, 10.0), (10.0, 10.0), (5.0, 20.0)]
    those = [(x + 3.0, y - 2.0) for x, y in these]
    assert odd_pair(these, those, 0.5) == "", "all fit, so none is odd"
    assert odd_pair(these, [*those[:4], (90.0, 0.0)], 0.5) == "; without pair 5 the others fit"
    assert odd_pair(these, [(40.0, 0.0), *those[1:4], (90.0, 0.0)], 0.5) == ""
    assert odd_pair(these[:3], [*those[:2], (90.0, 0.0)], 0.5) == "", "any two pairs fit"
    assert odd_pair([these[0]] * 3 + [these[1]], those[:4], 0.5) == ""

"""Devices as HTML and SVG: the words, the marks, and names that never become markup."""

from xml.etree import ElementTree

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.words import Stated
from bridges.observe.requesters import Moment
from workbench.graph.board import BoardRow
from workbench.page import drawing
from workbench.page.live_site import DeviceView, RobotShown, Stands

WALL = 1_700_000_000.0
HOSTILE = "<script>alert(1)</script>\"'&"
LIFT = d.LiftState(
    lift_name="Lift1",
    available_floors=("L1", "L2", "L3"),
    current_floor="L2",
    destination_floor="L3",
    door_state=d.LiftDoor.DOOR_CLOSED,
    motion_state=d.LiftMotion.MOTION_UP,
)


def well_formed(html: str) -> ElementTree.Element:
    return ElementTree.fromstring(f"<all>{html}</all>")


def test_a_shaft_has_its_highest_floor_on_top_and_says_what_it_shows() -> None:
    root = well_formed(drawing.shaft(LIFT))
    texts = [(one.text or "").strip() for one in root.iter("text")]
    assert texts == ["◎ L3", "L2", "L1", "▲"]
    (svg,) = root.iter("svg")
    assert svg.get("aria-label") == (
        "car at L2, going up, door closed, mode UNKNOWN, destination L3"
    )


def test_a_car_at_no_known_floor_is_not_drawn() -> None:
    root = well_formed(drawing.shaft(d.LiftState(available_floors=("L1", "L2"))))
    assert [one.get("class") for one in root.iter("rect")] == ["shaft", "shaft"]


UP, DOWN, UNKNOWN = d.LiftMotion.MOTION_UP, d.LiftMotion.MOTION_DOWN, d.LiftMotion.MOTION_UNKNOWN


@pytest.mark.parametrize(
    ("left", "motion", "to", "place", "told"),
    [
        (2.0, UP, "L3", 1.5, "car between L1 and L2, going up"),
        (1.5, UP, "L3", 1.5, "car between L1 and L2, going up"),
        (0.0, DOWN, "", 0.5, "car between L2 and L3, going down"),
        (2.0, UNKNOWN, "L3", 1.5, "car between L1 and L2"),
        (0.0, UP, "L3", None, "car between floors, going up"),
        (7.5, UP, "L3", None, "car between floors, going up"),
        (None, DOWN, "L1", None, "car between floors, going down"),
        (1.0, UNKNOWN, "", None, "car at no known floor"),
    ],
)
def test_a_car_between_floors_is_drawn_between_the_last_and_the_next_or_told_of(
    left: float | None, motion: int, to: str, place: float | None, told: str
) -> None:
    lift = replace(LIFT, current_floor="", motion_state=motion, destination_floor=to)
    assert drawing.car_place(lift, left) == place
    root = well_formed(
        drawing.card(DeviceView(BoardRow("lift", "A", words.condition(lift)), lift), left)
    )
    (svg,) = root.iter("svg")
    assert str(svg.get("aria-label")).startswith(told)
    assert told in "".join(root.itertext())
    assert bool([one for one in root.iter("rect") if one.get("class") == "car"]) == (
        place is not None
    )


def test_what_is_wrong_comes_with_what_to_do() -> None:
    row = BoardRow("lift", HOSTILE, "", mark="SILENT 5 s", faults="OVERLOAD (3 s); NEW (x)")
    root = well_formed(
        drawing.attention([DeviceView(row)], {"OVERLOAD": ("too many", "step <out>")})
    )
    text = "".join(root.itertext())
    assert HOSTILE in text
    assert "OVERLOAD (3 s); NEW (x)" in text
    assert "Do: step <out>" in text
    silent = DeviceView(BoardRow("lift", "A", "", mark="SILENT 5 s"))
    told = "".join(well_formed(drawing.attention([silent], {})).itertext())
    assert "Do: run `rmf-bridge status`" in told
    assert drawing.attention([], {}) == ""


def test_a_lift_with_a_thousand_floors_is_described_in_words_only() -> None:
    floors = tuple(map(str, range(1000)))
    assert drawing.shaft(d.LiftState(available_floors=floors)) == ""


@pytest.mark.parametrize("kind", ["lift", "door", "charger", "alarm", "coordinator", "robot"])
def test_a_name_is_shown_as_text_and_never_as_markup(kind: str) -> None:
    row = BoardRow(kind, HOSTILE, HOSTILE, HOSTILE, HOSTILE, HOSTILE, HOSTILE, True, HOSTILE)
    states: dict[str, Stated] = {
        "lift": d.LiftState(available_floors=(HOSTILE,), current_floor=HOSTILE),
        "door": d.DoorState(door_name=HOSTILE),
        "charger": d.ChargerState(charger_name=HOSTILE, error_message=HOSTILE),
    }
    root = well_formed(drawing.card(DeviceView(row, states.get(kind))))
    assert not list(root.iter("script"))
    assert HOSTILE in "".join(root.itertext())


def test_a_device_has_a_page_of_its_own_whatever_its_name() -> None:
    assert drawing.path_of("door", "a/../b?c#d") == "/door/a%2F..%2Fb%3Fc%23d"


def test_an_old_state_says_that_it_is_old_and_how_old() -> None:
    row = BoardRow("door", "ward", "open", age="12.0 s", mark="SILENT 12 s")
    root = well_formed(drawing.card(DeviceView(row, heard_wall=1_700_000_000.25)))
    text = "".join(root.itertext())
    assert "OLD: silent since " in text
    assert [one.get("data-at") for one in root.iter("time")] == ["1700000000.250"]
    assert "was" in text
    assert "now" not in text


@pytest.mark.parametrize(
    ("stands", "told"),
    [
        (Stands(59.0, at_least=False), "less than a minute"),
        (Stands(185.0, at_least=False), "3 min"),
        (Stands(185.0, at_least=True), "at least 3 min"),
        (Stands(5.0, at_least=True), "since before this page listened"),
    ],
)
def test_a_charger_says_how_long_its_robot_has_it(stands: Stands, told: str) -> None:
    html = drawing.card(
        DeviceView(BoardRow("charger", "pad", "charging", "fleet/R1"), stands=stands)
    )
    texts = [one.text for one in well_formed(html).iter("dd")]
    assert texts == ["charging", "fleet/R1", told]


def test_a_robot_whose_fleet_is_silent_is_old() -> None:
    state = d.RobotState("r1", battery_percent=250.0, location=d.Location(level_name="L1"))
    root = well_formed(drawing.robots([RobotShown("fleet", state, Moment(100.0, WALL))], now=120.0))
    cells = ["".join(cell.itertext()) for cell in root.iter("td")]
    assert cells == ["fleet/r1", "idle (OLD: silent since )", "L1", "100 %"]
    assert [one.get("data-at") for one in root.iter("time")] == [f"{WALL:.3f}"]

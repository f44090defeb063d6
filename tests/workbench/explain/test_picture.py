"""The timeline as SVG: the position of each element, and names that never become markup."""

from datetime import UTC, timedelta, timezone
from xml.etree import ElementTree

import pytest

from workbench.explain.palette import DARK, LIGHT, TONES, ToneStyle
from workbench.explain.picture import svg
from workbench.explain.timeline import Lane, LaneSpan, Mark, Timeline

WALL = 1_800_000_000.0  # 2027-01-15 08:00:00 UTC
NS = "{http://www.w3.org/2000/svg}"
SESSION = Lane("sessions", "", (LaneSpan(0, 30, "fleet/red", "held"),), ())
DOOR = Lane("door", "", (LaneSpan(0, 10, "closed", "calm"), LaneSpan(10, 30, "open", "open")), ())
FAULT = Lane("faults", "FIRE", (LaneSpan(20, 30, "FIRE", "wrong"),), (Mark(20, "FIRE", "wrong"),))


def drawn(*lanes: Lane, to_s: float = 30, width: int = 1200) -> ElementTree.Element:
    timeline = Timeline("lift", "Lift1", 0, to_s, WALL, lanes)
    return ElementTree.fromstring(svg(timeline, width, UTC))


def texts(root: ElementTree.Element) -> list[str]:
    return [one.text or "" for one in root.iter(f"{NS}text")]


def hints(root: ElementTree.Element) -> list[str]:
    return [one.text or "" for one in root.iter(f"{NS}title")]


def test_each_span_says_what_it_shows_and_from_when_to_when() -> None:
    assert hints(drawn(SESSION, DOOR, FAULT)) == [
        "sessions: fleet/red, 08:00:00.0 to 08:00:30.0 (30 s)",
        "door: closed, 08:00:00.0 to 08:00:10.0 (10 s)",
        "door: open, 08:00:10.0 to 08:00:30.0 (20 s)",
        "faults FIRE: FIRE, 08:00:20.0 to 08:00:30.0 (10 s)",
        "faults FIRE: FIRE, 08:00:20.0",
    ]


def test_spans_stand_where_their_times_are() -> None:
    boxes = [one for one in drawn(DOOR).iter(f"{NS}rect") if one.get("class", "").startswith("f-")]
    closed, opened = boxes[:2]
    left, wide = float(closed.get("x", "")), float(closed.get("width", ""))
    assert float(opened.get("x", "")) == pytest.approx(left + wide, abs=0.2)
    assert float(opened.get("width", "")) == pytest.approx(2 * wide, abs=0.3)


def test_round_times_are_written_at_the_axis() -> None:
    found = [text for text in texts(drawn(SESSION)) if text.startswith("08:")]
    assert found[::2] == [f"08:00:{second:02}" for second in range(0, 31, 5)]


def test_times_are_round_in_the_zone_they_are_written_in() -> None:
    half = timezone(timedelta(hours=5, minutes=30))
    timeline = Timeline("lift", "Lift1", 0, 86400, WALL, (SESSION,))
    found = texts(ElementTree.fromstring(svg(timeline, 1200, half)))
    assert "14:00:00" in found
    assert all(text.endswith(":00:00") for text in found if text.count(":") == 2 and len(text) == 8)


HOSTILE = "</text><script>alert(1)</script>&\"'<svg onload=x>"


def test_a_hostile_name_is_text() -> None:
    lane = Lane(
        "sessions", HOSTILE, (LaneSpan(0, 30, HOSTILE, "held"),), (Mark(5, HOSTILE, "asks"),)
    )
    picture = svg(Timeline("lift", HOSTILE, 0, 30, WALL, (lane,)), 4000, UTC)
    root = ElementTree.fromstring(picture)
    assert "<script" not in picture
    assert {one.tag.removeprefix(NS) for one in root.iter()} <= {
        *("svg", "style", "defs", "pattern", "path", "rect", "text", "line", "title")
    }
    assert HOSTILE in texts(root)
    attributes = {name for one in root.iter() for name in one.attrib}
    assert not any(name.startswith("on") or "href" in name for name in attributes)


def test_nothing_outside_the_file_is_asked_for() -> None:
    picture = svg(Timeline("lift", "Lift1", 0, 30, WALL, (SESSION, FAULT)), 1200, UTC)
    assert picture.replace("http://www.w3.org/2000/svg", "").count("http") == 0
    assert "url(" not in picture.replace("url(#p-", "")


def test_a_label_that_does_not_fit_is_cut_and_its_hint_is_whole() -> None:
    lane = Lane("mode", "", (LaneSpan(0, 2, "a very long label", "works"),), ())
    root = drawn(lane, to_s=60, width=600)
    assert not any(text.startswith("a very long") for text in texts(root))
    assert "mode: a very long label, 08:00:00.0 to 08:00:02.0 (2.0 s)" in hints(root)


def test_of_a_robot_the_fleet_is_cut_and_never_the_name() -> None:
    for width in range(480, 2400, 60):
        robots = ("hospital_porters/delivery_1", "hospital_porters/delivery_2")
        spans = tuple(LaneSpan(10 * n, 10 * n + 8, who, "held") for n, who in enumerate(robots))
        asks = tuple(
            LaneSpan(10 * n, 10 * n + 8, f"L4 for {who}", "asks") for n, who in enumerate(robots)
        )
        for lane in (Lane("sessions", "", spans, ()), Lane("requests", "", asks, ())):
            found = [one for one in texts(drawn(lane, to_s=60, width=width)) if "deliv" in one]
            assert len(found) == len(set(found))
            assert all("delivery_1" in one or "delivery_2" in one for one in found)


def test_spans_too_narrow_to_be_seen_are_joined_and_what_is_wrong_shows() -> None:
    spans = [LaneSpan(n / 10, (n + 1) / 10, f"L{n}", "calm") for n in range(1000)]
    spans[500] = LaneSpan(50.0, 50.1, "?", "wrong")
    root = drawn(Lane("floors", "", tuple(spans), ()), to_s=36000)
    boxes = [one for one in root.iter(f"{NS}rect") if one.find(f"{NS}title") is not None]
    assert len(boxes) < 10
    assert any(one.get("class") == "f-wrong" for one in boxes)


def test_an_empty_timeline_says_so() -> None:
    assert "Nothing was heard about the device in this time." in texts(drawn())


def test_a_picture_says_what_was_left_out() -> None:
    root = drawn(Lane("floors", "", (LaneSpan(0, 9, "L1", "calm"),), (), left_out=12))
    assert "from 2027-01-15 08:00:00, 30 s, 12 older parts left out" in texts(root)


def test_a_stepped_clock_is_a_line_across() -> None:
    step = Mark(10, "the clock was stepped by +3600 s", "wrong")
    timeline = Timeline("lift", "Lift1", 0, 30, WALL, (SESSION,), (step,))
    assert step.label in texts(ElementTree.fromstring(svg(timeline, 1200, UTC)))


def _luminance(colour: str) -> float:
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.03928 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(text: str, back: str) -> float:
    """Return the contrast ratio (WCAG 2.2). Success criterion 1.4.3 demands 4.5 for text."""
    lighter, darker = sorted((_luminance(back), _luminance(text)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


@pytest.mark.parametrize("looks", [LIGHT, DARK], ids=["light", "dark"])
def test_labels_can_be_read_on_every_tone(looks: dict[str, ToneStyle]) -> None:
    """Check the contrast of a label with both colours behind it: the fill, and the pattern on the
    fill."""
    backs = {tone: filter(None, (looks[tone].fill, looks[tone].pattern)) for tone in TONES}
    found = {t: min(contrast(looks[t].text, back) for back in backs[t]) >= 4.5 for t in TONES}
    assert found == dict.fromkeys(TONES, True)

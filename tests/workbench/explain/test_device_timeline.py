"""The lanes of a timeline, which is made from messages. A lane is one row of the picture, such as the
door's row."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Final

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from tests.workbench.explain.story import Scene
from workbench.explain.device_timeline import MOST_ROWS, Drawing, lanes
from workbench.explain.rows import LONGEST_LABEL, MOST_SPANS
from workbench.explain.timeline import Lane, LaneSpan, Level, Mark, Timeline

WALL = 1_000_000.0
STATE = d.LiftState(
    lift_name="Lift1", current_floor="L1", door_state=d.LiftDoor.DOOR_CLOSED, current_mode=2
)
AGV = d.LiftRequest(lift_name="Lift1", session_id="fleet/red", request_type=1)


def heard(at: float, message: d.Message, topic: str = "lift_states", wall: float = WALL) -> Heard:
    """Return a message that was heard at this time. A state without a stamp gets this time as its
    stamp."""
    if isinstance(message, d.LiftState) and message.lift_time == d.Time():
        message = replace(message, lift_time=stamp(wall + at))
    return Heard(at, wall + at, topic, message)


def lane(timeline: Timeline, name: str, row: str = "") -> Lane:
    (found,) = (one for one in timeline.lanes if (one.name, one.row) == (name, row))
    return found


def told(spans: Sequence[LaneSpan]) -> list[tuple[float, float, str]]:
    return [(round(span.from_s, 1), round(span.to_s, 1), span.label) for span in spans]


def in_words(timeline: Timeline) -> list[str]:
    """Return one line for each lane, such as `requests fleet/red: 6.0-10.7 L2, *10.7 END`. Here
    `6.0-10.7 L2` is a span of time (s), and `*10.7 END` is a single moment (s)."""
    lines = []
    for one in timeline.lanes:
        spans = [f"{span.from_s:.1f}-{span.to_s:.1f} {span.label}" for span in one.spans]
        marks = [f"*{mark.at_s:.1f} {mark.label}" for mark in one.marks]
        lines.append(f"{one.name} {one.row}: ".replace(" :", ":") + ", ".join(spans + marks))
    return lines


RIDE: Final = [
    "sessions: 6.1-10.8 fleet/red, 13.9-21.0 fleet/blue",
    "floors: 4.1-7.2 L1, 7.2-8.2 ?, 8.2-15.5 L2, 15.5-16.5 ?, 16.5-21.0 L1, *6.1 to L2, "
    "*13.9 to L1",
    "door: 4.1-5.0 moving, 5.0-9.6 closed, 9.6-9.7 moving, 9.7-13.6 open, 13.6-18.0 moving, "
    "18.0-21.0 open",
    "motion: 4.1-9.7 unknown, 9.7-13.6 stopped, 13.6-18.0 unknown, 18.0-21.0 stopped",
    "mode: 4.1-6.6 HUMAN, 6.6-13.8 AGV, 13.8-14.8 HUMAN, 14.8-18.1 AGV, 18.1-21.0 FIRE",
    "relays agv_request: 7.0-14.0 yes, 15.0-19.0 yes",
    "relays call: 7.0-9.0 L2, 15.0-17.0 L1",
    "relays hold_door: 9.0-14.0 front, 17.0-19.0 front",
    "requests fleet/red: 6.0-10.7 L2, *10.7 END",
    "requests supervisor: 6.0-10.8 L2 for fleet/red, 10.9-21.0 L1 for fleet/blue, "
    "*10.8 END for fleet/red",
    "requests fleet/blue: 9.0-21.0 L1",
    "faults FIRE: 19.0-21.0 FIRE",
]
"""Expected lanes of a lift's ride, in the notation of `in_words`. `*10.7 END` is an END at 10.7 s."""

PASSAGE: Final = [
    "sessions fleet/red: 6.1-8.3 fleet/red",
    "door: 4.1-6.1 closed, 6.1-8.1 moving, 8.1-12.4 open, 12.4-15.3 moving, 15.3-16.3 closed",
    "relays hold_open: 7.0-12.0 yes",
    "requests fleet/red: 6.0-8.2 open, *8.2 closed",
    "requests supervisor: 6.0-8.3 open, *8.3 closed, *9.3 closed, *10.3 closed, "
    "*11.3 closed, *12.3 closed, *13.3 closed, *14.3 closed, *15.3 closed",
]
"""Expected lanes of a passage through a door, in the notation of `in_words`."""


def test_a_ride_is_drawn_as_its_lanes() -> None:
    scene = Scene("Lift1")
    red, blue = scene.robot("fleet/red"), scene.robot("fleet/blue")
    red.asks("Lift1", "L2")
    scene.run(3.0)
    blue.asks("Lift1", "L1")
    scene.until(red)
    red.ends("Lift1")
    scene.until(blue)
    scene.press("Lift1", "fire_alarm", True)
    scene.run(3.0)
    assert in_words(lanes(scene.heard, "lift", "Lift1")) == RIDE


def test_a_session_lasts_until_a_state_shows_another() -> None:
    of_red, of_blue = replace(STATE, session_id="red"), replace(STATE, session_id="blue")
    states = [of_red, of_red, of_blue, STATE]
    drawn = lanes([heard(n, state) for n, state in enumerate(states)], "lift", "Lift1")
    assert lane(drawn, "sessions").spans == (
        LaneSpan(0, 2, "red", "held"),
        LaneSpan(2, 3, "blue", "held"),
    )


def test_a_device_that_has_fallen_silent_is_shown_as_unknown() -> None:
    drawn = lanes([heard(0, STATE), heard(2, STATE), heard(60, STATE)], "lift", "Lift1")
    assert told(lane(drawn, "floors").spans) == [(0, 2, "L1"), (2, 60, "not heard")]


def test_a_silence_at_the_end_is_drawn_to_the_end() -> None:
    other = replace(STATE, lift_name="Lift2")
    drawn = lanes([heard(0, STATE), heard(2, STATE), heard(30, other)], "lift", "Lift1")
    assert told(lane(drawn, "mode").spans) == [(0, 2, "AGV"), (2, 30, "not heard")]


def test_requests_have_a_row_for_each_requester_and_one_for_the_supervisor() -> None:
    to_l2, end = replace(AGV, destination_floor="L2"), replace(AGV, request_type=0)
    said = [
        heard(0, to_l2, "adapter_lift_requests"),
        heard(0, to_l2, "lift_requests"),
        heard(1, to_l2, "adapter_lift_requests"),
        heard(2, end, "adapter_lift_requests"),
        heard(3, STATE),
    ]
    drawn = lanes(said, "lift", "Lift1")
    assert lane(drawn, "requests", "fleet/red") == Lane(
        "requests", "fleet/red", (LaneSpan(0, 2, "L2", "asks"),), (Mark(2, "END", "asks"),)
    )
    assert told(lane(drawn, "requests", "supervisor").spans) == [(0, 3, "L2 for fleet/red")]


def test_what_the_daemon_noted_takes_the_place_of_diagnostics() -> None:
    outputs = d.KeyValue("outputs", "agv_request yes")
    status = d.DiagnosticStatus(0, "n: Lift1", "OK", "Lift1", (d.KeyValue("kind", "lift"), outputs))
    said: list[Heard | Level] = [
        heard(0, d.DiagnosticArray(status=(status,)), "diagnostics"),
        Level(0.5, "relays", "call", "L2"),
        Level(0.7, "inputs", "door_opened", "on"),
        Level(1.5, "relays", "call", ""),
        heard(2, d.DiagnosticArray(status=(status,)), "diagnostics"),
    ]
    drawn = lanes(said, "lift", "Lift1")
    assert [(one.name, one.row, told(one.spans)) for one in drawn.lanes] == [
        ("relays", "call", [(0.5, 1.5, "L2")]),
        ("inputs", "door_opened", [(0.7, 2, "on")]),
    ]


def test_a_fault_lasts_while_the_device_or_its_supervisor_has_it() -> None:
    def says(at: float, node: str, kind: str, *codes: str) -> Heard:
        values = (d.KeyValue("kind", kind), *(d.KeyValue(code, "why") for code in codes))
        level = d.DiagnosticLevel.ERROR if codes else d.DiagnosticLevel.OK
        status = d.DiagnosticStatus(level, f"{node}: Lift1", ", ".join(codes), "Lift1", values)
        return heard(at, d.DiagnosticArray(status=(status,)), "diagnostics")

    said = [
        says(0, "node", "lift", "FIRE", "OVERLOAD"),
        says(0, "super", "lift_supervisor", "FIRE"),
        says(1, "node", "lift", "OVERLOAD"),
        says(2, "node", "lift"),
        says(2, "super", "lift_supervisor", "FIRE"),
        says(3, "super", "lift_supervisor"),
        says(4, "node", "lift"),
    ]
    drawn = lanes(said, "lift", "Lift1")
    assert [(one.row, told(one.spans)) for one in drawn.lanes] == [
        ("FIRE", [(0, 3, "why")]),
        ("OVERLOAD", [(0, 2, "why")]),
    ]


def test_an_old_reading_and_a_stamp_of_the_future_are_faults() -> None:
    old = replace(STATE, lift_time=stamp(WALL - 100))
    ahead = replace(STATE, lift_time=stamp(WALL + 100))
    never = replace(STATE, lift_name="Lift1")
    said = [heard(0, old), heard(1, ahead), heard(2, STATE)]
    said += [Heard(3, WALL + 3, "lift_states", never), heard(4, STATE)]
    drawn = lanes(said, "lift", "Lift1")
    assert told(lane(drawn, "faults", "stamp").spans) == [
        (0, 1, "the reading is old"),
        (1, 2, "the stamp is in the future"),
        (3, 4, "never read"),
    ]


def test_a_clock_that_is_stepped_moves_nothing_and_is_marked() -> None:
    said = [heard(0, STATE), heard(1, STATE, wall=WALL + 3600), heard(2, STATE, wall=WALL + 3600)]
    drawn = lanes(said, "lift", "Lift1")
    assert (drawn.from_s, drawn.to_s) == (0, 2)
    assert drawn.steps == (Mark(1, "the clock was stepped by +3600 s", "wrong"),)


def test_a_message_out_of_order_counts_as_if_it_came_now() -> None:
    said = [heard(5, STATE), heard(4, replace(STATE, current_floor="L2")), heard(6, STATE)]
    assert told(lane(lanes(said, "lift", "Lift1"), "floors").spans) == [(5, 6, "L2")]


def test_a_part_of_a_recording_is_cut_to_its_times() -> None:
    said = [heard(n, replace(STATE, current_floor=f"L{n // 10}")) for n in range(40)]
    drawn = lanes(said, "lift", "Lift1", 5, 25)
    assert (drawn.from_s, drawn.to_s, drawn.wall) == (5, 25, WALL + 5)
    assert told(lane(drawn, "floors").spans) == [(5, 10, "L0"), (10, 20, "L1"), (20, 25, "L2")]


def test_nothing_heard_is_an_empty_timeline() -> None:
    assert lanes([], "door", "ward") == Timeline("door", "ward", 0, 0, 0, ())


def test_a_door_is_drawn_with_who_holds_it() -> None:
    scene = Scene("ward")
    red = scene.robot("fleet/red")
    red.opens("ward")
    scene.until(red)
    red.closes("ward")
    scene.until(red)
    scene.run(8.0)
    assert in_words(lanes(scene.heard, "door", "ward")) == PASSAGE


def test_a_restarted_supervisors_close_ends_the_hold_in_the_picture() -> None:
    scene = Scene("ward", rmf=True)
    red = scene.robot("fleet/red")
    red.opens("ward")
    scene.until(red)
    scene.run(2.0)
    scene.supervisors["rmf_door_supervisor"].kill()
    scene.run(1.0)
    scene.supervisors["rmf_door_supervisor"].start()
    scene.run(30.0)
    (hold,) = lane(lanes(scene.heard, "door", "ward"), "sessions", "fleet/red").spans
    assert 3.0 < hold.to_s - hold.from_s < 8.0


def test_a_charger_is_drawn_with_its_robot() -> None:
    idle = d.ChargerState(stamp(WALL), d.ChargerStateValue.CHARGER_IDLE, "bay1")
    error = replace(idle, state=200, error_message="too hot", request_id="r1")
    request = d.ChargerRequest("bay1", "fleet", "red", d.Duration(), "r1")
    said = [heard(0, idle), heard(1, request), heard(2, error), heard(3, idle)]
    drawn = lanes(said, "charger", "bay1")
    assert [(one.name, one.row, told(one.spans)) for one in drawn.lanes] == [
        ("sessions", "", [(2, 3, "request r1")]),
        ("mode", "", [(0, 2, "idle"), (2, 3, "error: too hot")]),
        ("requests", "fleet/red", []),
    ]


def test_names_from_the_network_are_printable_and_short() -> None:
    drawn = lanes([heard(0, replace(STATE, session_id="\x1b[2J" + "x" * 999)), heard(1, STATE)],
                  "lift", "Lift1")  # fmt: skip
    (span,) = lane(drawn, "sessions").spans
    assert span.label.startswith("\\x1b[2Jxxx")
    assert len(span.label) == LONGEST_LABEL


def test_a_flood_of_names_and_changes_is_bounded_and_counted() -> None:
    drawing = Drawing("lift", "Lift1")
    for n in range(3 * MOST_SPANS):
        drawing.take(heard(n, replace(STATE, current_floor=f"L{n}", destination_floor=f"L{n}")))
        drawing.take(heard(n, replace(AGV, session_id=f"made/up{n}"), "adapter_lift_requests"))
    drawn = drawing.timeline()
    floors = lane(drawn, "floors")
    assert (len(floors.spans), len(floors.marks)) == (MOST_SPANS, MOST_SPANS)
    assert len([one for one in drawn.lanes if one.name == "requests"]) <= MOST_ROWS
    assert drawn.left_out == 3 * MOST_SPANS - MOST_ROWS


def test_spans_older_than_a_live_page_shows_are_forgotten() -> None:
    drawing = Drawing("lift", "Lift1", past_s=20.0)
    for n in range(100):
        floor = f"L{n // 10}"
        drawing.take(heard(n, replace(STATE, current_floor=floor, destination_floor=floor)))
    floors = lane(drawing.timeline(), "floors")
    assert told(floors.spans) == [(60, 70, "L6"), (70, 80, "L7"), (80, 90, "L8"), (90, 99, "L9")]
    assert [(mark.at_s, mark.label) for mark in floors.marks] == [
        (70, "to L7"),
        (80, "to L8"),
        (90, "to L9"),
    ]
    assert floors.left_out == 0


def test_a_timeline_is_json() -> None:
    drawn = lanes([heard(0, STATE), heard(1, STATE)], "lift", "Lift1")
    floors = json.loads(json.dumps(asdict(drawn)))["lanes"][0]
    span = {"from_s": 0, "to_s": 1, "label": "L1", "tone": "calm"}
    assert floors == {"name": "floors", "row": "", "spans": [span], "marks": [], "left_out": 0}

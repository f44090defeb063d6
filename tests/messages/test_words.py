"""The words with which `watch`, `send` and the demo print messages."""

from bridges.messages import definitions as d
from bridges.messages import stamps, words


def test_a_lift_state_tells_position_destination_door_and_mode() -> None:
    state = d.LiftState(
        lift_name="Lift1",
        current_floor="L1",
        destination_floor="L3",
        door_state=d.LiftDoor.DOOR_CLOSED,
        motion_state=d.LiftMotion.MOTION_UP,
        current_mode=d.LiftMode.MODE_AGV,
        session_id="fleet/robot",
    )
    assert words.condition(state) == "car at L1, going up, door closed, mode AGV, destination L3"
    assert words.holder(state) == "fleet/robot"
    assert words.device(state) == "Lift1"


def test_a_lift_between_floors_without_motion_lines_claims_neither_floor_nor_motion() -> None:
    state = d.LiftState(motion_state=d.LiftMotion.MOTION_UNKNOWN, door_state=1)
    assert words.condition(state) == "car at no known floor, door moving, mode UNKNOWN"


def test_a_number_that_rmf_does_not_define_is_shown_as_a_number() -> None:
    assert words.condition(d.DoorState(current_mode=d.DoorMode(7))) == "7?"
    assert words.condition(d.ChargerState(state=238)) == "238?"


def test_a_name_from_the_network_cannot_move_the_cursor() -> None:
    state = d.LiftState(current_floor="L1\x1b[2J\n", session_id="a\rb")
    assert words.condition(state) == "car at L1\\x1b[2J\\n, door closed, mode UNKNOWN"
    assert words.holder(state) == "a\\rb"


def test_a_charger_state_tells_error_robot_and_remaining_time() -> None:
    failed = d.ChargerState(state=200, error_message="over temperature")
    charging = d.ChargerState(
        state=3,
        request_id="r1",
        robot_fleet="fleet",
        robot_name="robot",
        time_to_fully_charged=d.Duration(720),
    )
    assert words.condition(failed) == "error: over temperature"
    assert words.condition(charging) == "charging, full in 12 min"
    assert words.holder(charging) == "fleet/robot (request r1)"


def test_each_request_tells_its_content_and_its_sender() -> None:
    asked: list[words.Requested] = [
        d.LiftRequest("Lift1", d.Time(), "fleet/robot", 1, "L3", 2),
        d.LiftRequest("Lift1", d.Time(), "fleet/robot", 0, "", 0),
        d.DoorRequest(d.Time(), "door_supervisor", "ward", d.DoorMode(2)),
        d.ChargerRequest("a", "fleet", "robot", d.Duration(30), "r1"),
        d.ChargerCancel("a", "r1"),
    ]
    assert [words.request(message) for message in asked] == [
        "mode AGV, car to L3, door open, for fleet/robot",
        "end the session of fleet/robot",
        "door open, for door_supervisor",
        "charge fleet/robot (request r1)",
        "cancel request r1",
    ]


def test_seconds_and_stamps_convert_both_ways_and_the_stamp_of_never_is_zero() -> None:
    assert stamps.stamp(1700000000.25) == d.Time(1700000000, 250000000)
    assert stamps.in_seconds(d.Time(1700000000, 250000000)) == 1700000000.25
    assert stamps.stamp(-1.0) == d.Time()
    assert stamps.duration(1.5) == d.Duration(1, 500000000)
    assert words.stamped_at(d.DoorState()) == 0

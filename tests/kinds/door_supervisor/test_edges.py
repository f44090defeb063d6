"""The supervisor accepts or refuses RMF's messages, and the table of holders in its state directory."""

import pytest

from bridges.kinds.door_supervisor import KIND, core, keep, messages, report
from bridges.kinds.door_supervisor.memory import DoorSupervisorLimits, Holder, SupervisedDoor
from bridges.kinds.door_supervisor.report import DoorHoldReport
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings
from bridges.kinds.door_supervisor.signals import DoorStateHeard, RequesterCloses, RequesterOpens
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.fields import quiet_s
from bridges.kinds.shared.freshness import Requester
from bridges.messages import definitions as d
from bridges.messages import topics

ANY = DoorSupervisorSettings()
AT = d.Time(5, 7)


def request(
    mode: int = 2, who: str = "fleet/a", door: str = "ward", time: d.Time = AT
) -> d.DoorRequest:
    return d.DoorRequest(time, who, door, d.DoorMode(mode))


def refused(message: d.DoorRequest, settings: DoorSupervisorSettings = ANY) -> str:
    with pytest.raises(RequestRefused) as refusal:
        messages.accept_request(message, settings, 0.0)
    return str(refusal.value)


def test_open_and_close_keep_the_stamp_of_their_sender_to_the_nanosecond() -> None:
    late = d.Time(2**31 - 1, 999_999_999)
    assert messages.accept_request(request(), ANY, 0.0) == RequesterOpens("fleet/a", 5_000_000_007)
    assert messages.accept_request(request(0, time=late), ANY, 0.0) == RequesterCloses(
        "fleet/a", 2_147_483_647_999_999_999
    )


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (request(door=""), "empty door_name: a door needs a name"),
        (request(who=""), "no requester: requester_id is empty"),
        (
            request(who="door_supervisor"),
            "a supervisor's request: adapter_door_requests is for adapters",
        ),
        (
            request(1),
            "mode that cannot be asked: requested_mode 1 is neither OPEN (2) nor CLOSED (0)",
        ),
        (
            request(7),
            "mode that cannot be asked: requested_mode 7 is neither OPEN (2) nor CLOSED (0)",
        ),
        (request(who="x" * 257), f"impossible requester_id: '{'x' * 40}'…, 257 characters"),
        (request(door="x" * 257), f"impossible door_name: '{'x' * 40}'…, 257 characters"),
        (request(time=d.Time(-1, 0)), "impossible request_time: -1 s 0 ns"),
        (request(time=d.Time(1, 10**9)), "impossible request_time: 1 s 1000000000 ns"),
    ],
)
def test_half_filled_and_impossible_requests_are_refused(message: d.DoorRequest, text: str) -> None:
    assert refused(message) == text


def test_a_list_of_doors_keeps_other_doors_out() -> None:
    mine = DoorSupervisorSettings(doors=["ward", "lab"])
    assert refused(request(door="gate"), mine) == "not ours: 'gate' is not one of ward, lab"
    assert messages.accept_request(request(door="lab"), mine, 0.0) == RequesterOpens(
        "fleet/a", 5_000_000_007
    )
    with pytest.raises(RequestRefused, match="not ours"):
        messages.accept_state(d.DoorState(d.Time(), "gate", d.DoorMode(2)), mine, 0.0)


def test_a_state_of_any_age_is_accepted_but_an_unknown_mode_is_refused() -> None:
    for mode in d.DoorModeValue:
        state = d.DoorState(d.Time(), "ward", d.DoorMode(int(mode)))
        assert messages.accept_state(state, ANY, 0.0) == DoorStateHeard(mode)
    with pytest.raises(RequestRefused, match="unknown current_mode: 9"):
        messages.accept_state(d.DoorState(d.Time(), "ward", d.DoorMode(9)), ANY, 0.0)


def test_a_message_gets_its_stamp_at_the_time_of_sending() -> None:
    assert messages.stamped(request(), d.Time(9, 1)) == request(time=d.Time(9, 1))
    beat = d.SupervisorHeartbeat((d.DoorSessions("ward", (d.Session(AT, "a"),)),))
    assert messages.stamped(beat, d.Time(9, 1)) == beat
    assert messages.device_name(request()) == "ward"


def test_the_summary_names_the_holders_of_the_door_and_the_time_of_each_hold() -> None:
    empty = DoorHoldReport(None)
    assert messages.summary(empty, 0.0) == {"mode": "-", "held_by": "-"}
    held = DoorHoldReport(1.0, d.DoorModeValue.MODE_OPEN, (("fleet/a", 2.0), ("web", 10.0)))
    assert messages.summary(held, 14.0) == {
        "mode": "OPEN",
        "held_by": "fleet/a (12 s), web (4 s)",
    }


def test_the_settings_reach_the_core_and_the_quiet_start() -> None:
    settings = DoorSupervisorSettings(quiet_start_s=5.0, open_alarm_s=60.0)
    assert (DoorSupervisorLimits.of(settings), quiet_s(settings)) == (
        DoorSupervisorLimits(60.0),
        5.0,
    )
    assert list(ANY.problems()) == []
    assert [path for path, _ in DoorSupervisorSettings(doors=[]).problems()] == [("doors",)]


def test_the_daemon_uses_the_names_and_topics_of_rmfs_own_supervisor() -> None:
    assert set(KIND.requests) == {topics.ADAPTER_DOOR_REQUESTS, topics.DOOR_STATES}
    assert set(KIND.publishes) == {topics.DOOR_REQUESTS, topics.DOOR_SUPERVISOR_HEARTBEAT}
    assert KIND.sole == (topics.DOOR_REQUESTS,)


# --- the table on disk ------------------------------------------------------------------------


def held(door: str, **stamps: int) -> SupervisedDoor:
    return SupervisedDoor(
        door, holders=tuple(Holder(who, 0.0, 0.0, at, at) for who, at in stamps.items())
    )


def test_the_heartbeat_lists_doors_and_holders_in_the_order_of_names() -> None:
    memories = {"b": held("b", z=10**9, y=2), "c": held("c"), "a": held("a", x=3)}
    assert report.heartbeat(memories) == (
        topics.DOOR_SUPERVISOR_HEARTBEAT,
        d.SupervisorHeartbeat(
            (
                d.DoorSessions("a", (d.Session(d.Time(0, 3), "x"),)),
                d.DoorSessions("b", (d.Session(d.Time(0, 2), "y"), d.Session(d.Time(1, 0), "z"))),
            )
        ),
    )


def test_the_file_changes_with_the_holders_and_not_with_repeats() -> None:
    memory = core.initial("ward", 0.0)
    written = []
    for second in range(10):
        memory = core.decide(
            memory, RequesterOpens("a", second), float(second), DoorSupervisorLimits()
        ).memory
        written.append(keep.persist({"ward": memory}))
    assert set(written) == {b'{"version":1,"doors":{"ward":{"a":0}}}'}
    memory = core.decide(memory, RequesterOpens("a", 13), 13.0, DoorSupervisorLimits()).memory
    assert keep.persist({"ward": memory}) == b'{"version":1,"doors":{"ward":{"a":13}}}'
    memory = core.decide(memory, RequesterCloses("a", 14), 14.0, DoorSupervisorLimits()).memory
    assert keep.persist({"ward": memory}) == b'{"version":1,"doors":{}}'


def test_after_a_restart_the_holders_are_known_and_older_requests_are_stale() -> None:
    kept = keep.persist(
        {"ward": held("ward", b=5, a=7), "lab": held("lab"), "gate": held("gate", c=1)}
    )
    restored = keep.restore(kept, DoorSupervisorSettings(doors=["ward", "lab"]), 50.0)
    assert restored == {
        "ward": SupervisedDoor(
            "ward",
            holders=(
                Holder("a", 50.0, 50.0, 7, 7, restored=True),
                Holder("b", 50.0, 50.0, 5, 5, restored=True),
            ),
            requesters={"a": Requester(7, heard_at=50.0), "b": Requester(5, heard_at=50.0)},
        )
    }
    stale = core.decide(restored["ward"], RequesterCloses("a", 6), 51.0, DoorSupervisorLimits())
    assert stale.refused == "stale request"
    assert set(keep.restore(kept, ANY, 50.0)) == {"ward", "gate"}


@pytest.mark.parametrize(
    "kept",
    [
        b"",
        b"\x00\x00\x00",
        b'{"version":1,"doors":{"ward":{"a":1}',
        b'{"version":1,"doors":{"":{"a":1}}}',
        b'{"version":1,"doors":{"ward":{"":1}}}',
        b'{"version":1,"doors":{"ward":{"a":-1}}}',
        b'{"version":1,"doors":{"ward":{"a":2147483648000000000}}}',
        b'{"version":1,"doors":{},"more":0}',
        b'{"version":2,"doors":{}}',
        b"\xff",
    ],
)
def test_a_table_that_is_cut_or_damaged_is_refused_as_a_whole(kept: bytes) -> None:
    with pytest.raises(ValueError, match="table"):
        keep.restore(kept, ANY, 0.0)


def test_a_file_that_is_no_table_is_refused_with_the_expected_form() -> None:
    with pytest.raises(ValueError, match=r"^not a table of doors and their holders: "):
        keep.restore(b"[]", DoorSupervisorSettings(), 0.0)

"""The messages that `mqtt-out` publishes for given states, in virtual time."""

import json
import re
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.observe.all_devices import PlainGraph
from workbench.graph.board import Board
from workbench.graph.retained import EXPIRES_S, RENEWED_S, Retained, Retainer, ShownDevice

WALL = 1_700_000_000.0
LIFT = d.LiftState(
    lift_time=stamp(WALL), lift_name="Lift1", current_floor="L1", door_state=2, current_mode=2
)
DOOR = d.DoorState(stamp(WALL), "ward", d.DoorMode(0))


class Site:
    """A graph, and a `Retainer` that makes the MQTT messages for the graph's states. At 0 s the wall
    clock reads WALL."""

    def __init__(self, discovery: str | None = None) -> None:
        self.graph = PlainGraph(most=2)
        self.board = Board(self.graph)
        self.retainer = Retainer("rmf", discovery)

    def hear(self, *states: d.Message, at: float = 0.0) -> None:
        for state in states:
            self.board.take(Heard(at, WALL + at, "", state))

    def due(self, at: float, *, given: bool = True) -> dict[str, str]:
        every = self.graph.stated()
        rows = self.board.rows_of(every, at, WALL + at)
        shown = [ShownDevice(*pair) for pair in zip(every, rows, strict=True)]
        found = list(self.retainer.due(shown, at, WALL + at))
        for message in found if given else ():
            self.retainer.given(message, at)
        return {message.topic: message.payload for message in found}


def test_a_device_is_its_state_and_its_availability() -> None:
    site = Site()
    site.hear(LIFT, DOOR)
    found = site.due(0.5)
    assert list(found) == [
        "rmf/status",
        *("rmf/lift/Lift1/state", "rmf/lift/Lift1/availability"),
        *("rmf/door/ward/state", "rmf/door/ward/availability"),
    ]
    assert found["rmf/status"] == found["rmf/door/ward/availability"] == "online"
    assert json.loads(found["rmf/lift/Lift1/state"]) == {
        "floor": "L1",
        "destination": "",
        "door": "open",
        "motion": "stopped",
        "mode": "agv",
        "name": "Lift1",
        "summary": "car at L1, door open, mode AGV",
        "held_by": "",
        "waiting": "",
        "mark": "",
        "faults": "",
        "simulated": False,
        "read_at": "2023-11-14T22:13:20.000+00:00",
        "published_at": "2023-11-14T22:13:20.500+00:00",
    }


def test_a_change_goes_out_at_once_a_new_stamp_does_not_and_everything_is_renewed() -> None:
    site = Site()
    site.hear(DOOR)
    site.due(0.0)
    site.hear(replace(DOOR, door_time=stamp(WALL + 1)), at=1.0)
    assert site.due(1.0) == {}
    site.hear(d.DoorState(stamp(WALL + 2), "ward", d.DoorMode(2)), at=2.0)
    assert list(site.due(2.0)) == ["rmf/door/ward/state"]
    site.hear(d.DoorState(stamp(WALL + 60), "ward", d.DoorMode(2)), at=60.0)
    assert list(site.due(RENEWED_S)) == ["rmf/status", "rmf/door/ward/availability"]
    assert 2 * RENEWED_S < EXPIRES_S


def test_what_the_broker_did_not_take_is_due_again_and_after_a_loss_everything_is() -> None:
    site = Site()
    site.hear(DOOR)
    first = site.due(0.0, given=False)
    assert site.due(0.0) == first
    assert site.due(0.1) == {}
    site.retainer.forget()
    assert list(site.due(0.2)) == list(first)


@pytest.mark.parametrize(
    ("read_s", "now", "mark"), [(0.0, 3.6, "STALE"), (0.0, 9.0, "SILENT"), (20.0, 1.0, "CLOCK")]
)
def test_a_silent_or_old_device_is_offline_and_its_state_says_so(
    read_s: float, now: float, mark: str
) -> None:
    site = Site()
    site.hear(d.DoorState(stamp(WALL + read_s), "ward", d.DoorMode(0)), at=0.0)
    if mark != "SILENT":
        site.hear(d.DoorState(stamp(WALL + read_s), "ward", d.DoorMode(0)), at=now)
    found = site.due(now)
    assert found["rmf/door/ward/availability"] == "offline"
    assert json.loads(found["rmf/door/ward/state"])["mark"] == mark


def test_a_device_that_was_never_read_is_offline_without_a_time() -> None:
    site = Site()
    site.hear(d.DoorState(d.Time(), "ward", d.DoorMode(4)))
    found = site.due(0.0)
    assert found["rmf/door/ward/availability"] == "offline"
    assert json.loads(found["rmf/door/ward/state"])["read_at"] is None


NAMES = [
    "a/b",
    "a_b",
    "a+b",
    "a#b",
    "a_2Fb",
    "a b",
    "ä",
    "Ã¤",
    "a\nb",
    "a\\nb",
    "$SYS",
    "_",
    "__",
    "🛗",
]


def test_no_two_names_become_one_topic_and_every_topic_is_a_plain_one() -> None:
    topics = set()
    for name in NAMES:
        site = Site("homeassistant")
        site.hear(d.DoorState(stamp(WALL), name, d.DoorMode(0)))
        [_, state, available, config] = site.due(0.0)
        assert re.fullmatch(r"rmf/door/[A-Za-z0-9_-]+/state", state)
        assert re.fullmatch(r"homeassistant/device/[A-Za-z0-9_-]+/config", config)
        topics |= {state, available, config}
    assert len(topics) == 3 * len(NAMES)


def test_two_names_that_print_alike_are_two_devices() -> None:
    site = Site()
    site.hear(*(d.DoorState(stamp(WALL), name, d.DoorMode(0)) for name in ("a\nb", "a\\nb")))
    assert len(site.due(0.0)) == 5


def test_names_without_end_stay_in_bounds_and_a_forgotten_device_leaves_the_broker() -> None:
    site = Site("homeassistant")
    for n in range(50):
        site.hear(d.DoorState(stamp(WALL), f"made up {n}", d.DoorMode(0)))
    first = site.due(0.0)
    assert len(first) == 1 + 3 * 2
    for n in range(2):
        site.hear(d.DoorState(stamp(WALL + 9000), f"real {n}", d.DoorMode(0)), at=9000.0)
    found = site.due(9000.0)
    assert {t for t, payload in found.items() if not payload} == {*first} - {"rmf/status"}
    assert len([t for t, payload in found.items() if payload]) == 1 + 3 * 2
    assert site.due(9000.1) == {}


def test_discovery_names_only_topics_that_are_published_and_no_command() -> None:
    site = Site("homeassistant")
    site.hear(replace(LIFT, lift_name="East / 1"))
    found = site.due(0.0)
    [(topic, text)] = [item for item in found.items() if item[0].endswith("/config")]
    assert topic == "homeassistant/device/rmf_lift_East_20_2F_201/config"
    told: dict[str, Any] = json.loads(text)
    assert told["dev"] == {"ids": "rmf_lift_East_20_2F_201", "name": "lift East / 1"}
    assert told["o"]["name"] == "rmf-bridges"
    assert {part["name"]: part["p"] for part in told["cmps"].values()} == {
        "state": "sensor",
        "floor": "sensor",
        "door": "sensor",
        "problem": "binary_sensor",
    }
    ids = [part["unique_id"] for part in told["cmps"].values()]
    assert len(set(ids)) == len(ids)
    named = {told["state_topic"], *(one["topic"] for one in told["availability"])}
    for part in told["cmps"].values():
        named |= {one["topic"] for one in part.get("availability", [])}
    assert named == {*found} - {topic}
    assert "command" not in text


def test_an_empty_payload_deletes() -> None:
    retainer = Retainer("rmf", None)
    retainer.given(Retained("rmf/door/x/state", "{}", 1), 0.0)
    assert [m.topic for m in retainer.due([], 0.0, WALL) if not m.payload] == ["rmf/door/x/state"]

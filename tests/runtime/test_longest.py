"""Messages with a string of ten megabytes. No kind of daemon may keep so long a string in an event."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from msgspec import Struct
from msgspec.structs import replace

from bridges.kinds import kind_called
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.definitions import Message
from bridges.messages.topics import Topic
from bridges.settings.load import load

CONFIG = Path(__file__).parents[2] / "config"
HUGE = "x" * 10_000_000
KEPT_MOST = 20_000
"""The limit on the length of an event (in characters) that a kind of daemon makes from one message."""

ROBOT = d.RobotState(
    name="AMR01", task_id="t", mode=d.RobotMode(int(d.RobotModeValue.MODE_CHARGING))
)
LIFT = d.LiftRequest(
    "Lift1", session_id="fleet/r", request_type=1, destination_floor="L3", door_state=2
)
DOOR = d.DoorRequest(requester_id="r", door_name="ward_door", requested_mode=d.DoorMode(2))
WISH = d.ChargerRequest("", "tiny", "AMR01", d.Duration(60), "id")
HEARD: dict[str, dict[Topic[Any], Message]] = {
    "lift_dry_contact": {
        topics.LIFT_REQUESTS: LIFT,
        topics.ADAPTER_LIFT_REQUESTS.live(): LIFT,
    },
    "door_modbus": {topics.DOOR_REQUESTS: DOOR},
    "charger_http": {
        topics.CHARGER_REQUESTS: WISH,
        topics.CHARGER_CANCELS: d.ChargerCancel(request_id="id"),
    },
    "lift_supervisor": {
        topics.ADAPTER_LIFT_REQUESTS: LIFT,
        topics.LIFT_STATES: d.LiftState(
            lift_name="Lift1", current_floor="L1", available_floors=("L1", "L3")
        ),
    },
    "door_supervisor": {
        topics.ADAPTER_DOOR_REQUESTS: DOOR,
        topics.DOOR_STATES: d.DoorState(door_name="ward_door"),
    },
    "charger_coordinator": {
        topics.CHARGER_STATES: d.ChargerState(state=1, charger_name="charger_a", error_message="e"),
        topics.FLEET_STATES: d.FleetState("tiny", (ROBOT,)),
        topics.ADAPTER_CHARGER_REQUESTS: WISH,
        topics.ADAPTER_CHARGER_CANCELS: d.ChargerCancel(request_id="id"),
        topics.CHARGING_ASSIGNMENTS: d.ChargingAssignments(
            "tiny", (d.ChargingAssignment("AMR01", "charger_a", int(d.ChargingMode.MODE_CHARGE)),)
        ),
    },
}


def taker(name: str, topic: Topic[Any]) -> Callable[[Message], object]:
    """Return a function that turns a message on this topic into an event.

    The settings come from the shipped YAML file `name`.
    """
    config = load(CONFIG / f"{name}.yaml")
    kind = kind_called(config.kind)
    if isinstance(kind, GraphKind):
        accept = kind.requests[topic]
        return lambda message: accept(message, config.section, 1.8e9)
    settings = next(iter(config.devices.values()))
    return lambda message: kind.requests[topic](message, settings)


def with_huge(value: Any) -> Iterator[Any]:
    """Yield one copy of the value for each of its strings. In each copy one string is huge."""
    if isinstance(value, str):
        yield HUGE
    elif isinstance(value, tuple):
        for i, item in enumerate(value):
            yield from ((*value[:i], huge, *value[i + 1 :]) for huge in with_huge(item))
    elif isinstance(value, Struct):
        for field in value.__struct_fields__:
            for huge in with_huge(getattr(value, field)):
                yield replace(value, **{field: huge})


@pytest.mark.parametrize(
    ("name", "topic"), [(name, topic) for name, heard in HEARD.items() for topic in heard]
)
def test_no_string_of_a_message_is_kept_beyond_a_maximum_length(
    name: str, topic: Topic[Any]
) -> None:
    take, message = taker(name, topic), HEARD[name][topic]
    take(message)
    for sent in with_huge(message):
        try:
            kept = repr(take(sent))
        except RequestRefused as refusal:
            kept = f"{refusal.kind} {refusal.detail}"
        assert len(kept) < KEPT_MOST


def test_every_topic_that_a_kind_hears_is_covered() -> None:
    for name, heard in HEARD.items():
        assert set(heard) == set(kind_called(load(CONFIG / f"{name}.yaml").kind).requests)

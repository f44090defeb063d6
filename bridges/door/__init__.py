"""Doors."""

from bridges.core.kind import Kind
from bridges.door import core, messages
from bridges.door.settings import DoorLimits, DoorSettings
from bridges.door.signals import DoorOutputs, DoorSample
from bridges.rmf import topics

KIND: Kind[
    DoorSettings,
    DoorLimits,
    core.DoorMemory,
    DoorSample,
    core.OpenDoor | core.CloseDoor,
    DoorOutputs,
    core.DoorReport,
] = Kind(
    name="door",
    devices_key="doors",
    states=topics.DOOR_STATES,
    requests={topics.DOOR_REQUESTS: messages.accept},
    device_name=lambda message: str(message.door_name),
    sender=lambda request: str(request.requester_id),
    limits=DoorLimits.of,
    initial=core.initial,
    decide=core.decide,
    state_message=messages.state_message,
    summary=messages.summary,
)

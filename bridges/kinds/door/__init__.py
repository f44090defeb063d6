"""Doors: a DoorRequest switches a relay or a register, and the door's inputs make a DoorState."""

from bridges.kinds.door import core, memory, messages, pulses, report, signals
from bridges.kinds.door.memory import DoorLimits, DoorMemory
from bridges.kinds.door.report import DoorReport
from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import CloseRequested, DoorOutputs, DoorSample, OpenRequested
from bridges.kinds.shared.decision import Attended
from bridges.kinds.shared.kind import Kind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages import topics

KIND: Kind[
    DoorSettings,
    DoorLimits,
    DoorMemory,
    DoorSample,
    OpenRequested | CloseRequested | Attended,
    DoorOutputs,
    DoorReport,
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
    repeated=core.repeated,
    state_message=messages.state_message,
    attended_by=topics.DOOR_REQUESTS,
    recorded=(topics.ADAPTER_DOOR_REQUESTS,),
    summary=messages.summary,
    alarm_inputs=lambda report: report.alarm,
)

RECORDED: Recorded = {
    "door.memory.Memory": memory.DoorMemory,
    "door.memory.Senses": memory.DoorSenses,
    "door.pulses.DoorPulses": pulses.DoorPulses,
    "door.report.DoorReport": report.DoorReport,
    "door.signals.CloseRequested": signals.CloseRequested,
    "door.signals.DoorOutputs": signals.DoorOutputs,
    "door.signals.DoorSample": signals.DoorSample,
    "door.signals.OpenRequested": signals.OpenRequested,
}

"""The door supervisor between the fleet adapters and all doors. It replaces the door supervisor of
RMF."""

from bridges.kinds.door_supervisor import core, keep, memory, messages, report, signals
from bridges.kinds.door_supervisor.memory import DoorSupervisorLimits, SupervisedDoor
from bridges.kinds.door_supervisor.report import DoorHoldReport
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings, speaks_of
from bridges.kinds.door_supervisor.signals import DoorStateHeard, RequesterCloses, RequesterOpens
from bridges.kinds.shared.fields import quiet_s
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages.topics import (
    ADAPTER_DOOR_REQUESTS,
    DOOR_REQUESTS,
    DOOR_STATES,
    DOOR_SUPERVISOR_HEARTBEAT,
)

KIND: GraphKind[
    DoorSupervisorSettings,
    DoorSupervisorLimits,
    SupervisedDoor,
    RequesterOpens | RequesterCloses | DoorStateHeard,
    DoorHoldReport,
] = GraphKind(
    name="door_supervisor",
    devices_key="supervisor",
    settings=DoorSupervisorSettings,
    requests={
        ADAPTER_DOOR_REQUESTS: messages.accept_request,
        DOOR_STATES: messages.accept_state,
    },
    publishes=(DOOR_REQUESTS, DOOR_SUPERVISOR_HEARTBEAT),
    sole=(DOOR_REQUESTS,),
    device_name=messages.device_name,
    quiet_s=quiet_s,
    limits=DoorSupervisorLimits.of,
    initial=core.initial,
    decide=core.decide,
    stamped=messages.stamped,
    summary=messages.summary,
    idle=core.idle,
    shown_by=DOOR_STATES,
    reserved=lambda settings: settings.doors or (),
    requester=messages.requester,
    requesters=lambda memory: memory.requesters,
    together=report.heartbeat,
    persist=keep.persist,
    restore=keep.restore,
    urgent=core.urgent,
    speaks_of=speaks_of,
)

RECORDED: Recorded = {
    "door_supervisor.memory.Holder": memory.Holder,
    "door_supervisor.memory.Memory": memory.SupervisedDoor,
    "door_supervisor.report.DoorHoldReport": report.DoorHoldReport,
    "door_supervisor.signals.CloseRequested": signals.RequesterCloses,
    "door_supervisor.signals.OpenRequested": signals.RequesterOpens,
    "door_supervisor.signals.StateHeard": signals.DoorStateHeard,
}

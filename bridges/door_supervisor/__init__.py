"""The door supervisor: in the place of RMF's own, between fleet adapters and any number of doors."""

from bridges.core.graph_kind import GraphKind
from bridges.door_supervisor import core, messages, table
from bridges.door_supervisor.settings import Settings
from bridges.rmf.topics import (
    ADAPTER_DOOR_REQUESTS,
    DOOR_REQUESTS,
    DOOR_STATES,
    DOOR_SUPERVISOR_HEARTBEAT,
)


def limits(settings: Settings) -> core.Limits:
    """What the core is to know of the YAML."""
    return core.Limits(open_alarm_s=settings.open_alarm_s)


def quiet_s(settings: Settings) -> float:
    """How long to listen before the first word."""
    return settings.quiet_start_s


KIND: GraphKind[
    Settings,
    core.Limits,
    core.Memory,
    core.Opens | core.Closes | core.Shown,
    core.DoorHoldReport,
] = GraphKind(
    name="door_supervisor",
    devices_key="supervisor",
    settings=Settings,
    requests={
        ADAPTER_DOOR_REQUESTS: messages.accept_request,
        DOOR_STATES: messages.accept_state,
    },
    publishes=(DOOR_REQUESTS, DOOR_SUPERVISOR_HEARTBEAT),
    sole=(DOOR_REQUESTS,),
    device_name=messages.device_name,
    quiet_s=quiet_s,
    limits=limits,
    initial=core.initial,
    decide=core.decide,
    stamped=messages.stamped,
    summary=messages.summary,
    idle=core.idle,
    together=table.heartbeat,
    persist=table.persist,
    restore=table.restore,
)

"""The lift supervisor: in the place of RMF's own, between fleet adapters and any number of lifts."""

import math

from bridges.core.graph_kind import GraphKind
from bridges.lift_supervisor import core, messages
from bridges.lift_supervisor.memory import Asked, Ended, Limits, Memory, Shown
from bridges.lift_supervisor.report import SupervisorReport
from bridges.lift_supervisor.settings import Settings
from bridges.rmf.topics import ADAPTER_LIFT_REQUESTS, LIFT_REQUESTS, LIFT_STATES


def limits(settings: Settings) -> Limits:
    """What the core is to know of the YAML."""
    ttl_s = settings.holder_ttl_s
    return Limits(
        silent_after_s=settings.silent_after_s,
        orphan_after_s=settings.quiet_start_s,
        holder_alarm_s=settings.holder_alarm_s,
        holder_ttl_s=math.inf if ttl_s is None else ttl_s,
        clock_synchronised=settings.clock_synchronised,
        max_request_age_s=settings.max_request_age_s,
    )


def quiet_s(settings: Settings) -> float:
    """How long to listen before the first word."""
    return settings.quiet_start_s


KIND: GraphKind[Settings, Limits, Memory, Asked | Ended | Shown, SupervisorReport] = GraphKind(
    name="lift_supervisor",
    devices_key="supervisor",
    settings=Settings,
    requests={
        ADAPTER_LIFT_REQUESTS: messages.accept_request,
        LIFT_STATES: messages.accept_state,
    },
    publishes=(LIFT_REQUESTS,),
    sole=(LIFT_REQUESTS,),
    device_name=messages.device_name,
    quiet_s=quiet_s,
    limits=limits,
    initial=core.initial,
    decide=core.decide,
    stamped=messages.stamped,
    summary=messages.summary,
    idle=core.idle,
)

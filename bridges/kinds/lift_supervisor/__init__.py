"""The lift supervisor between the fleet adapters and all lifts. It replaces the lift supervisor of
RMF."""

from bridges.kinds.lift_supervisor import core, memory, messages, report, signals
from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits, SupervisedLift
from bridges.kinds.lift_supervisor.report import SupervisorReport
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings, speaks_of
from bridges.kinds.lift_supervisor.signals import LiftStateHeard, RideEnded, RideRequested
from bridges.kinds.shared.fields import quiet_s
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages.topics import ADAPTER_LIFT_REQUESTS, LIFT_REQUESTS, LIFT_STATES

KIND: GraphKind[
    LiftSupervisorSettings,
    LiftSupervisorLimits,
    SupervisedLift,
    RideRequested | RideEnded | LiftStateHeard,
    SupervisorReport,
] = GraphKind(
    name="lift_supervisor",
    devices_key="supervisor",
    settings=LiftSupervisorSettings,
    requests={
        ADAPTER_LIFT_REQUESTS: messages.accept_request,
        LIFT_STATES: messages.accept_state,
    },
    publishes=(LIFT_REQUESTS,),
    sole=(LIFT_REQUESTS,),
    device_name=messages.device_name,
    quiet_s=quiet_s,
    limits=LiftSupervisorLimits.of,
    initial=core.initial,
    decide=core.decide,
    stamped=messages.stamped,
    summary=messages.summary,
    idle=core.idle,
    speaks_of=speaks_of,
    shown_by=LIFT_STATES,
    reserved=lambda settings: settings.lifts or (),
    requester=messages.requester,
    requesters=lambda memory: memory.requesters,
)

RECORDED: Recorded = {
    "lift_supervisor.memory.Claim": memory.SessionClaim,
    "lift_supervisor.memory.Memory": memory.SupervisedLift,
    "lift_supervisor.memory.Turn": memory.Turn,
    "lift_supervisor.report.SupervisorReport": report.SupervisorReport,
    "lift_supervisor.signals.Ended": signals.RideEnded,
    "lift_supervisor.signals.Requested": signals.RideRequested,
    "lift_supervisor.signals.StateHeard": signals.LiftStateHeard,
    "lift_supervisor.signals.Target": signals.Target,
}

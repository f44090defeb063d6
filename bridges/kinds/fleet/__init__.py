"""Fleets: RMF's fleet adapter gives goals, and the daemon sends each robot to its goals through the
maker's interface."""

from bridges.kinds.fleet import core, keep, light, memory, messages, report, signals
from bridges.kinds.fleet.memory import RobotLimits, RobotMemory
from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.settings import FleetFiles, FleetRobotSettings
from bridges.kinds.fleet.signals import Order, PadHeard, RobotOutputs, RobotSample
from bridges.kinds.shared.kind import Kind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages import topics

KIND: Kind[
    FleetRobotSettings,
    RobotLimits,
    RobotMemory,
    RobotSample,
    Order | PadHeard,
    RobotOutputs,
    RobotReport,
] = Kind(
    name="fleet",
    devices_key="robots",
    section=("fleet", FleetFiles),
    states=topics.FLEET_STATES,
    requests={topics.CHARGER_STATES: messages.accept},
    device_name=messages.robot_of,
    sender=lambda request: str(request.charger_name),
    limits=RobotLimits.of,
    initial=core.initial,
    decide=core.decide,
    state_message=messages.state_message,
    summary=messages.summary,
    keeping=keep.KEEPING,
)

RECORDED: Recorded = {
    "fleet.light.LightQuestion": light.LightQuestion,
    "fleet.memory.LightMemory": memory.LightMemory,
    "fleet.memory.Pad": memory.Pad,
    "fleet.memory.RobotMemory": memory.RobotMemory,
    "fleet.report.RobotReport": report.RobotReport,
    "fleet.signals.Act": signals.Act,
    "fleet.signals.Goal": signals.Goal,
    "fleet.signals.LightAnswer": signals.LightAnswer,
    "fleet.signals.Localize": signals.Localize,
    "fleet.signals.Navigate": signals.Navigate,
    "fleet.signals.PadHeard": signals.PadHeard,
    "fleet.signals.Pose": signals.Pose,
    "fleet.signals.RobotCommand": signals.RobotCommand,
    "fleet.signals.RobotOutputs": signals.RobotOutputs,
    "fleet.signals.RobotSample": signals.RobotSample,
    "fleet.signals.Stop": signals.Stop,
}

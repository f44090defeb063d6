"""The names under which values of a core are stored in rings and recordings. A recorded name never
changes, even if its class moves or is renamed. Therefore every version of the daemon reads the files
of all earlier versions.

`RECORDED` in each kind's folder has the values of that kind. `SHARED` has the values that all kinds
share.
"""

from collections.abc import Mapping
from typing import Any, Final

from bridges.kinds.shared import debounce, decision, freshness, graph_kind
from bridges.messages import constants
from bridges.messages.definitions import PACKAGES

Recorded = Mapping[str, type[Any]]
"""A table that maps a recorded name to its type. Each type has one name, which begins with the name of
its kind."""

SHARED: Final[Recorded] = {
    "core.debounce.Settled": debounce.Settled,
    "core.decision.AlarmInputs": decision.AlarmInputs,
    "core.decision.Attended": decision.Attended,
    "core.decision.DecidedByPerson": decision.DecidedByPerson,
    "core.decision.Fault": decision.Fault,
    "core.decision.IoFailed": decision.IoFailed,
    "core.decision.MemoryKept": decision.MemoryKept,
    "core.decision.MemoryNotKept": decision.MemoryNotKept,
    "core.decision.OperatorReset": decision.OperatorReset,
    "core.decision.RivalSeen": decision.RivalSeen,
    "core.decision.Sampled": decision.Sampled,
    "core.decision.Suspended": decision.Suspended,
    "core.decision.WriteFailed": decision.WriteFailed,
    "core.freshness.Requester": freshness.Requester,
    "core.graph_kind.MaySpeak": graph_kind.MaySpeak,
    "core.graph_kind.Woken": graph_kind.Woken,
    "rmf.constants.AlertTier": constants.AlertTier,
    "rmf.constants.ChargerStateValue": constants.ChargerStateValue,
    "rmf.constants.ChargingMode": constants.ChargingMode,
    "rmf.constants.DiagnosticLevel": constants.DiagnosticLevel,
    "rmf.constants.DoorModeValue": constants.DoorModeValue,
    "rmf.constants.LiftDoor": constants.LiftDoor,
    "rmf.constants.LiftMode": constants.LiftMode,
    "rmf.constants.LiftMotion": constants.LiftMotion,
    "rmf.constants.LiftRequestDoor": constants.LiftRequestDoor,
    "rmf.constants.LiftRequestType": constants.LiftRequestType,
    "rmf.constants.RobotModeValue": constants.RobotModeValue,
    "rmf.constants.WorkcellMode": constants.WorkcellMode,
    "rmf.constants.WorkcellStatus": constants.WorkcellStatus,
    **{f"rmf.definitions.{message.__name__}": message for message in PACKAGES},  # named as in ROS
}

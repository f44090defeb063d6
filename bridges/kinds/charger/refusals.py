"""The published answer to a refused ChargerRequest, and the function that reads the answer.

ChargerState shows only the station's true state, and RMF has no message for a refusal. Therefore the
daemon publishes a refusal as a diagnostic_msgs/DiagnosticStatus on a separate topic,
`charger_refusals`. Every ROS machine has this type, and `ros2 topic echo` shows its fields by their
names.
"""

from collections.abc import Mapping

import msgspec
from msgspec.structs import replace

from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger.signals import ChargeRequested
from bridges.kinds.shared.kind import RefusalAnswer
from bridges.messages.definitions import ChargerRequest, DiagnosticLevel, DiagnosticStatus, KeyValue
from bridges.messages.topics import CHARGER_REFUSALS
from bridges.messages.words import LONGEST_NAME

NAME = "ChargerRequest refused"
OCCUPIED = "charger occupied"
"""The reason of a temporary refusal: it ends when the robot that has the charger releases it. Refusals
for any other reason do not end by themselves."""
LONGEST_REASON = 500


class ChargerRefusal(msgspec.Struct, frozen=True, kw_only=True):
    """The reason of a refusal, and the robot that has the charger.

    `robot`: the FLEET/ROBOT of the refused request. `state`: the charger's state, under its name in
    RMF. `held_by`: the robot that has the charger; "" if no robot has it. `held_request`: the id of
    that robot's request; "" if no robot has the charger. `error`: the charger's error text, "" without
    an error.
    """

    request_id: str
    charger: str
    robot: str
    reason: str
    state: str = ""
    held_by: str = ""
    held_request: str = ""
    error: str = ""

    @property
    def text(self) -> str:
        """Summarise in one line: `charger occupied: tiny/AMR01 has it (request req-1)`."""
        request = f" (request {self.held_request})" if self.held_request else ""
        who = f"{self.held_by or 'a robot'} has it{request}" if self.held_by or request else ""
        return ": ".join(filter(None, (self.reason, "; ".join(filter(None, (who, self.error))))))

    def message(self) -> DiagnosticStatus:
        """Make the published message. Its key-value pairs are the fields of this struct."""
        values = tuple(KeyValue(key, value) for key, value in self.fields().items())
        return DiagnosticStatus(int(DiagnosticLevel.WARN), NAME, self.text, self.charger, values)

    def fields(self) -> Mapping[str, str]:
        """Return the fields, for the status file."""
        return {key: getattr(self, key) for key in self.__struct_fields__}


def read(status: DiagnosticStatus) -> ChargerRefusal | None:
    """Parse a message that `ChargerRefusal.message` has made. Return None for any other status."""
    values = {pair.key: pair.value for pair in status.values}
    if status.name != NAME or not {"request_id", "charger", "robot", "reason"} <= values.keys():
        return None
    return ChargerRefusal(**{key: values.get(key, "") for key in ChargerRefusal.__struct_fields__})


def refused(request_id: str, charger: str, who: RobotName, reason: str) -> ChargerRefusal:
    """Make the refusal of a request. Cut its names, because a malformed request may have names of any
    length."""
    return ChargerRefusal(
        request_id=_cut(request_id),
        charger=_cut(charger),
        robot=f"{_cut(who.fleet)}/{_cut(who.name)}",
        reason=reason[:LONGEST_REASON],
    )


def answer(name: str, request: object, reason: str, report: ChargerReport) -> RefusalAnswer | None:
    """Make the published answer to a ChargerRequest that the charger `name` refuses. Return None if the
    refused message is no ChargerRequest.

    `request`: the message itself if it is malformed, else the core's event. `report`: the charger's
    present report.
    """
    match request:
        case ChargerRequest():
            request_id, fleet, robot = request.request_id, request.fleet_name, request.robot_name
        case ChargeRequested():
            request_id, fleet, robot = request.request_id, request.fleet, request.robot
        case _:
            return None
    refusal = replace(
        refused(request_id, name, RobotName(fleet, robot), reason),
        state=report.state.name.removeprefix("CHARGER_"),
        held_by=f"{report.fleet}/{report.robot}" if report.robot else "",
        held_request=report.request_id,
        error=report.error_message[:LONGEST_REASON],
    )
    return RefusalAnswer(CHARGER_REFUSALS, refusal.message(), refusal.fields())


def _cut(text: str) -> str:
    return text[:LONGEST_NAME]

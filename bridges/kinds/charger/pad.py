"""The robot on the pad, and the permission to energise the pad.

A robot carries a receiver, and the station reads the id of the receiver on its pad. The YAML's
`receivers` tell which robot carries which receiver. Without `receivers` the core assumes that the
request's robot is on the pad. With `receivers`, a station gives no power as long as it sees a receiver
but cannot read its id.

Some stations move their pad, or check the robot's range. Such a station gives power only if the pad is
at its height and the robot in range. No message announces that a robot leaves, so only the readings of
height and range show it. If the pad leaves its height while current flows, this is a fault of the
station.

ChargerState's error_message names a wrong robot or receiver on the pad. `Misplaced.text` writes that
text and `misplaced_in` reads it. An id that would make the text ambiguous is quoted as in JSON, so
every id can be read back.
"""

import json
import re
from typing import Literal

import msgspec
from msgspec.structs import replace

from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger.signals import CURRENT_FLOWS, Activity, ChargerSample
from bridges.kinds.shared.decision import Fault

WRONG_DOCKING = "WRONG_DOCKING"
WRONG_DOCKING_TEXT = "wrong docking: "
UNKNOWN_RECEIVER_TEXT = "unknown receiver "
HEIGHT_LOST_TEXT = "the pad left its height under power"
RECEIVER_NOT_TOLD_TEXT = "the YAML has receivers, but the charger does not say which one it sees"

_BARE = r"[^\s\",/\\]+"
_ID = rf'("(?:[^"\\]|\\.)*"|{_BARE})'
_ROBOT = f"{_ID}/{_ID}"
_TEXT = re.compile(
    rf"(?:{UNKNOWN_RECEIVER_TEXT}{_ID}"
    rf"|{WRONG_DOCKING_TEXT}{_ROBOT} (?:stands here|is not assigned here))"
    rf"(?:, {_ROBOT} is expected)?"
)


class PadOccupant(msgspec.Struct, frozen=True):
    """The occupant of the pad.

    `sort` has five values. `empty`: the pad is free. `robot`: the YAML lists the receiver. `stranger`:
    the YAML does not list the receiver. `mute`: the station does not identify the receiver.
    `unverified`: the YAML has no receivers.

    `receiver`: the id that the station sees. `robot`: the robot that carries the receiver; None if the
    YAML does not list the receiver.
    """

    sort: Literal["unverified", "mute", "empty", "robot", "stranger"]
    receiver: str = ""
    robot: RobotName | None = None

    def may_be(self, who: RobotName) -> bool:
        """Return whether this robot may be on the pad. Without `receivers` any robot may be there."""
        return self.sort == "unverified" or self.robot == who

    def is_another(self, who: RobotName) -> bool:
        """Return whether another robot is on the pad."""
        return self.sort in ("robot", "stranger") and self.robot != who


def seen(sample: ChargerSample | None, limits: ChargerLimits) -> PadOccupant:
    """Identify the pad's occupant from one reading."""
    if not limits.receivers:
        return PadOccupant("unverified")
    receiver = sample.measured.receiver_id if sample else None
    if receiver is None:
        return PadOccupant("mute")
    if not receiver:
        return PadOccupant("empty")
    known = limits.receivers.get(receiver)
    return PadOccupant("robot" if known else "stranger", receiver, known)


def not_ready(sample: ChargerSample) -> str:
    """Return why the reading forbids power for every robot; "" if the reading allows power."""
    if sample.measured.at_height is False:
        return "the pad is not at its height"
    return "the robot is not in range" if sample.measured.range_ok is False else ""


def judged(sample: ChargerSample) -> ChargerSample:
    """Return the reading. If the pad has left its height while the station charged, return the reading
    as a fault of the station."""
    if sample.activity is not Activity.CHARGING or sample.measured.at_height is not False:
        return sample
    return replace(
        sample,
        activity=Activity.ERROR,
        error_text=HEIGHT_LOST_TEXT,
        side="station",
        charges=True,
    )


class Misplaced(msgspec.Struct, frozen=True):
    """A wrong occupant of the pad. `robot`: its robot, if the YAML lists the receiver. `receiver`: the
    id of a receiver that the YAML does not list.

    `expected`: the robot for which the station waits, None if it waits for none.
    """

    robot: RobotName | None
    receiver: str = ""
    expected: RobotName | None = None

    @property
    def text(self) -> str:
        """The text for ChargerState's error_message."""
        expected = f", {_robot(self.expected)} is expected" if self.expected else ""
        if self.robot is None:
            return f"{UNKNOWN_RECEIVER_TEXT}{_id(self.receiver)}{expected}"
        does = "stands here" if self.expected else "is not assigned here"
        return f"{WRONG_DOCKING_TEXT}{_robot(self.robot)} {does}{expected}"


def misplaced_in(text: str) -> Misplaced | None:
    """Parse a text that `Misplaced.text` has written. Return None for any other text."""
    found = _TEXT.fullmatch(text)
    if found is None:
        return None
    receiver, *names = (part and _read(part) for part in found.groups())
    robot, expected = (
        RobotName(*names[i : i + 2]) if names[i] is not None else None for i in (0, 2)
    )
    return Misplaced(robot, receiver or "", expected)


def _robot(who: RobotName) -> str:
    return f"{_id(who.fleet)}/{_id(who.name)}"


def _id(text: str) -> str:
    return text if re.fullmatch(_BARE, text) else json.dumps(text, ensure_ascii=False)


def _read(part: str) -> str:
    return str(json.loads(part)) if part.startswith('"') else part


def misplaced(memory: ChargerMemory, limits: ChargerLimits) -> Fault | None:
    """Return a fault if a wrong robot or an unknown receiver on the pad must get no power. Return None
    if the occupant is not wrong."""
    pad, holder = seen(memory.sample, limits), memory.holder
    expected = holder.request.who if holder and not holder.over else None
    if pad.sort == "mute":
        return Fault("RECEIVER_NOT_TOLD", RECEIVER_NOT_TOLD_TEXT)
    if pad.sort == "stranger":
        return Fault("UNKNOWN_RECEIVER", Misplaced(None, pad.receiver, expected).text)
    if pad.robot is None or (holder and holder.request.who == pad.robot):
        return None
    if memory.adopted and not expected:
        return None
    return Fault(WRONG_DOCKING, Misplaced(pad.robot, expected=expected).text)


def left_alone(memory: ChargerMemory, limits: ChargerLimits) -> bool:
    """Return whether current flows without a request and must not be switched off."""
    if memory.sample is None or memory.sample.activity not in CURRENT_FLOWS:
        return False
    return memory.adopted or not limits.can_stop

"""Who stands on the pad: the handshake between the receiver that the station sees and the request.

Where the YAML has no `receivers`, nobody is verified and every robot counts as the one that asked.
Where it has some, a station that does not say whom it sees charges nobody.

What stands there and should not is told to RMF in ChargerState's error_message. `Misplaced.text`
writes it and `misplaced_in` reads it: an id that would be ambiguous in the sentence is quoted as in
JSON, so that no id is lost.
"""

import json
import re
from typing import Literal

import msgspec

from bridges.charger.memory import ChargerLimits, Memory
from bridges.charger.settings import Robot
from bridges.charger.signals import CURRENT_FLOWS, ChargerSample
from bridges.core.decision import Fault

WRONG_DOCKING = "WRONG_DOCKING"
WRONG_DOCKING_TEXT = "wrong docking: "
UNKNOWN_RECEIVER_TEXT = "unknown receiver "
RECEIVER_NOT_TOLD_TEXT = "receivers are given, and the charger does not say which one it sees"

_BARE = r"[^\s\",/\\]+"
_ID = rf'("(?:[^"\\]|\\.)*"|{_BARE})'
_ROBOT = f"{_ID}/{_ID}"
_TEXT = re.compile(
    rf"(?:{UNKNOWN_RECEIVER_TEXT}{_ID}"
    rf"|{WRONG_DOCKING_TEXT}{_ROBOT} (?:stands here|is not assigned here))"
    rf"(?:, {_ROBOT} is expected)?"
)


class Pad(msgspec.Struct, frozen=True):
    """`unverified`: the YAML knows no receivers. `mute`: the station does not say whom it sees.

    `receiver`: the id that it sees; `robot`: whose that is, None for a stranger's.
    """

    sort: Literal["unverified", "mute", "empty", "robot", "stranger"]
    receiver: str = ""
    robot: Robot | None = None

    def may_be(self, who: Robot) -> bool:
        """Nothing says that this robot is not there."""
        return self.sort == "unverified" or self.robot == who

    def is_another(self, who: Robot) -> bool:
        """Somebody else stands there."""
        return self.sort in ("robot", "stranger") and self.robot != who


def seen(sample: ChargerSample | None, limits: ChargerLimits) -> Pad:
    """The pad as one reading shows it."""
    if not limits.receivers:
        return Pad("unverified")
    receiver = sample.measured.receiver_id if sample else None
    if receiver is None:
        return Pad("mute")
    if not receiver:
        return Pad("empty")
    known = limits.receivers.get(receiver)
    return Pad("robot" if known else "stranger", receiver, known)


class Misplaced(msgspec.Struct, frozen=True):
    """What stands on the pad and should not: a `robot`, or None and the `receiver` of a stranger.

    `expected`: the robot that the station waits for; None for nobody.
    """

    robot: Robot | None
    receiver: str = ""
    expected: Robot | None = None

    @property
    def text(self) -> str:
        """As ChargerState's error_message has it."""
        expected = f", {_robot(self.expected)} is expected" if self.expected else ""
        if self.robot is None:
            return f"{UNKNOWN_RECEIVER_TEXT}{_id(self.receiver)}{expected}"
        does = "stands here" if self.expected else "is not assigned here"
        return f"{WRONG_DOCKING_TEXT}{_robot(self.robot)} {does}{expected}"


def misplaced_in(text: str) -> Misplaced | None:
    """What such a text says; None for any other text."""
    found = _TEXT.fullmatch(text)
    if found is None:
        return None
    receiver, *names = (part and _read(part) for part in found.groups())
    robot, expected = (Robot(*names[i : i + 2]) if names[i] is not None else None for i in (0, 2))
    return Misplaced(robot, receiver or "", expected)


def _robot(who: Robot) -> str:
    return f"{_id(who.fleet)}/{_id(who.name)}"


def _id(text: str) -> str:
    return text if re.fullmatch(_BARE, text) else json.dumps(text, ensure_ascii=False)


def _read(part: str) -> str:
    return str(json.loads(part)) if part.startswith('"') else part


def misplaced(memory: Memory, limits: ChargerLimits) -> Fault | None:
    """Why the station must not energise for what stands there; None where nothing forbids it."""
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


def left_alone(memory: Memory, limits: ChargerLimits) -> bool:
    """Current flows that nobody asked for, and it is not for us to stop it."""
    if memory.sample is None or memory.sample.activity not in CURRENT_FLOWS:
        return False
    return memory.adopted or not limits.can_stop or limits.unrequested == "serve_known"

"""Who stands on the pad: the handshake between the receiver that the station sees and the request.

Where the YAML has no `receivers`, nobody is verified and every robot counts as the one that asked.
Where it has some, a station that does not say whom it sees charges nobody.
"""

from typing import Literal

import msgspec

from bridges.charger.memory import Memory
from bridges.charger.settings import ChargerLimits, Robot
from bridges.charger.signals import CURRENT_FLOWS, ChargerSample
from bridges.core.decision import Fault

WRONG_DOCKING = "WRONG_DOCKING"


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


def misplaced(memory: Memory, limits: ChargerLimits) -> Fault | None:
    """Why the station must not energise for what stands there; None where nothing forbids it."""
    pad, holder = seen(memory.sample, limits), memory.holder
    expected = holder.request.who if holder and not holder.over else None
    if pad.sort == "mute":
        what = "receivers are given, and the charger does not say which one it sees"
        return Fault("RECEIVER_NOT_TOLD", what)
    if pad.sort == "stranger":
        told = f", {expected} is expected" if expected else ""
        return Fault("UNKNOWN_RECEIVER", f"unknown receiver {pad.receiver}{told}")
    if pad.robot is None or (holder and holder.request.who == pad.robot):
        return None
    if expected:
        what = f"wrong docking: {pad.robot} stands here, {expected} is expected"
        return Fault(WRONG_DOCKING, what)
    if memory.adopted:
        return None
    return Fault(WRONG_DOCKING, f"wrong docking: {pad.robot} is not assigned here")


def left_alone(memory: Memory, limits: ChargerLimits) -> bool:
    """Current flows that nobody asked for, and it is not for us to stop it."""
    if memory.sample is None or memory.sample.activity not in CURRENT_FLOWS:
        return False
    return memory.adopted or not limits.can_stop or limits.unrequested == "serve_known"

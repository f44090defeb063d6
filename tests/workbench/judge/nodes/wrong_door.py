"""Door nodes, each with one defect that occurred in the field. Each docstring names the defect, and
some name in brackets the project in which it occurred."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_door import LOOP_S, RightDoor
from workbench.rmf_model import Said


class CloseDrivesShut(RightDoor):
    """CLOSE starts the motor, so the door shuts on people who have opened it."""

    shut = False

    def asked(self, mode: int) -> None:
        super().asked(mode)
        self.shut = mode == 0

    def pushed(self, age_s: float) -> bool:
        pushed = super().pushed(age_s)
        self.shut = self.shut and pushed
        return pushed and not self.shut


class DoorAnswers(RightDoor):
    """The door publishes a state for each request."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        mine = isinstance(message, d.DoorRequest) and message.door_name == self.name
        return [(topics.DOOR_STATES, self.state(now))] if mine else []


class DoorFallsSilent(RightDoor):
    """The door publishes no state while its module does not answer."""

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [] if 10.0 < now - self.began_at < 18.0 else said


class DoorFlaps(RightDoor):
    """The contact that shows the open door is not debounced."""

    def mode(self) -> int:
        return 1 if self.leaf == 1.0 and int(self.due_at / LOOP_S) % 3 == 0 else super().mode()


class DoorHearsAdapters(RightDoor):
    """The door obeys adapter_door_requests. So the CLOSE of one robot shuts the door on another
    robot."""

    subscribes = (topics.ADAPTER_DOOR_REQUESTS,)


class DoorNumbersMixed(RightDoor):
    """The door takes the request mode 1 for OPEN, and ignores RMF's OPEN, which is 2."""

    def asked(self, mode: int) -> None:
        super().asked({1: 2, 0: 0}.get(mode, -1))


class DoorStaleOpen(RightDoor):
    """The module fails while the door is open, and the door publishes its last reading for ever."""

    frozen: d.DoorState | None = None

    def state(self, now: float) -> d.DoorState:
        if self.frozen is None and self.leaf == 1.0:
            self.frozen = super().state(now)
        return self.frozen or super().state(now)


class DoorVendorCodes(RightDoor):
    """The door publishes 5 (locked) in place of CLOSED. 5 is the door operator's own code."""

    def mode(self) -> int:
        return 5 if self.leaf == 0.0 else super().mode()


class DoorWithoutStamps(RightDoor):
    """The door never fills door_time."""

    def state(self, now: float) -> d.DoorState:
        return replace(super().state(now), door_time=d.Time())


class OpenAsAsked(RightDoor):
    """The door has no sensor, and shows OPEN as soon as a robot asks for OPEN."""

    def mode(self) -> int:
        return 2 if self.held else 0

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        return self.tick(now) if self.mode() != self._told else []


class SilenceCloses(RightDoor):
    """The door closes after 10 s without a request (lci-rmf-adapter)."""

    on_change = False

    def moves(self, now: float, age_s: float) -> None:
        self.held = self.held and now - self.heard_at < 10.0
        super().moves(now, age_s)


class DoorHearsEveryName(RightDoor):
    """The door obeys requests for other doors too."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.DoorRequest):
            super().hear(replace(message, door_name=self.name), now)
        return []


class DoorOnlyOnChange(RightDoor):
    """The door publishes only when it moves."""

    period_s = 1e6


class DoorPulses(RightDoor):
    """OPEN is a single pulse. The door operator's timer then shuts the door on the robot."""

    pulsed_at = 0.0

    def asked(self, mode: int) -> None:
        if mode == 2 and not self.held:
            self.pulsed_at = self.heard_at
        super().asked(mode)

    def moves(self, now: float, age_s: float) -> None:
        self.held = self.held and now - self.pulsed_at < 8.0
        super().moves(now, age_s)

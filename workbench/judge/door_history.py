"""The history of a door, with its requests and movements."""

from collections import deque
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.observe.door import ObservedDoor
from workbench.judge.history import NOT_YET, History

CLOSED: Final = d.DoorModeValue.MODE_CLOSED
OPEN: Final = d.DoorModeValue.MODE_OPEN
BLIND: Final = (d.DoorModeValue.MODE_OFFLINE, d.DoorModeValue.MODE_UNKNOWN)
REOPENS_WITHIN_S: Final = 1.0
AT_ONCE_S: Final = 0.3
CROSSES_S: Final = 0.5
"""Maximum delay (s) from a CLOSE until the state that it has caused is heard."""
DWELLS_S: Final = 0.5
"""Minimum time (s) for which a door operator keeps a door open for people."""
FLICKERS_S: Final = 0.9
"""Time (s) that is too short for a real door to close and open again."""
LATE_S: Final = FLICKERS_S + 1.0
OPENING_S: Final = 1.0
"""Minimum time (s) for which a door operator opens a door before the operator can reverse the door."""


class DoorHistory(History[d.DoorState]):
    """The history of one door. A latch is the time from an OPEN request to the next CLOSE request.

    - `latched`: whether a latch lasts now, because the last request was OPEN.
    - `was_closed`: whether the door was closed when this latch began.
    - `asked_at`: time of the first OPEN of this latch.
    - `openings`: number of OPEN requests since the door was last seen not closed.
    - `not_closed_at`: when the door was last seen not closed.
    - `closed_at`: time of the last CLOSE on door_requests.
    - `adapter_closed_at`: time of a fleet adapter's last CLOSE to the supervisor in this latch.
    - `was_open`: whether the door has been open in this latch.
    - `reopened`: times at which the door opened again immediately after it had left OPEN, in this
      latch.
    - `instant`: how many times in a row the door showed OPEN immediately after the request.
    - `opened`: whether the latest state is the first OPEN state of this latch.
    - `shut`: how many times in a row RMF's CLOSE closed a door that people had opened.
    - `asked_again_at`: time of the latest OPEN.
    - `ours`: whether the judge itself sent the latest OPEN, so that no CLOSE can be lost.
    - `lapses`: how many times in a row the held door closed, although neither a CLOSE nor another OPEN
      was heard. One CLOSE may be lost.
    - `left`: whether people had opened the door, RMF sent CLOSE during that time, and the latest state
      shows that the door closes or is closed.
    """

    observes = ObservedDoor

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.latched = self.was_open = self.opened = self.left = self.was_closed = False
        self.ours = False
        self.asked_at = self.not_closed_at = self.closed_at = self.adapter_closed_at = NOT_YET
        self.openings = 0
        self.reopened: deque[float] = deque(maxlen=3)
        self.instant = self.shut = self.lapses = 0
        self.asked_again_at = NOT_YET
        self._left_open_at = NOT_YET
        self._people_at = self._people_open_at = self._people_close_at = NOT_YET

    @property
    def mode(self) -> int:
        """The door's present mode."""
        return self.state.current_mode.value if self.state else -1

    @property
    def mode_before(self) -> int:
        """The door's mode in the previous state, or -1 if there is no previous state."""
        return self.before.current_mode.value if self.before else -1

    @staticmethod
    def claims(state: d.DoorState) -> bool:
        """Return whether a robot would act on this state, because the door is OPEN."""
        return state.current_mode.value == OPEN

    def take_other(self, heard: Heard) -> bool:
        """Take requests to this door, from the supervisor and from fleet adapters."""
        message = heard.message
        if not isinstance(message, d.DoorRequest) or message.door_name != self.name:
            return False
        mode = message.requested_mode.value
        if heard.topic == topics.ADAPTER_DOOR_REQUESTS.name:
            self.adapter_closed_at = self.now if mode == CLOSED else self.adapter_closed_at
            return False
        self.asked()
        if mode == OPEN:
            self._ask_open()
        elif mode == CLOSED:
            self._ask_close()
        return True

    def forget(self) -> None:
        """Forget the requests that came before a silence, because the node may have restarted."""
        self.latched = self.was_open = False
        self._people_at = NOT_YET
        self.not_closed_at = self.now

    def settle(self, state: d.DoorState) -> None:
        """Note the door's movement."""
        self.opened = self.left = False
        if self.mode != CLOSED:
            self.not_closed_at, self.openings = self.now, 0
        if self.mode in BLIND:
            self.was_open = False
            self._people_at = NOT_YET
        unasked = self._left_open_at > max(self.asked_again_at, self.closed_at)
        stays_shut = OPEN not in (self.mode, self.mode_before) and self.was_open and self.latched
        if stays_shut and unasked and self.now - self._left_open_at > LATE_S:
            self.lapses, self.latched, self.was_open = self.lapses + 1, False, False
        if self.mode != self.mode_before:
            self._changed()

    def _changed(self) -> None:
        if self.mode == OPEN:
            self._opens()
        elif self.mode_before == OPEN:
            self._left_open_at = self.now
            open_s = self.now - max(self._people_open_at, self._people_close_at)
            self._people_leave(open_s < DWELLS_S)
        if self.mode_before == CLOSED and not self.latched:
            self._people_at, self._people_open_at = self.now, NOT_YET
            crossed = self.now - self.closed_at < CROSSES_S
            self._people_close_at = self.closed_at if crossed else NOT_YET
            if self.mode == OPEN:
                self._people_open_at = self.now
        elif self.mode == CLOSED and self._people_at > NOT_YET:
            self._people_leave(self.now - self._people_close_at < OPENING_S)

    def _opens(self) -> None:
        if self.latched and self.was_closed and not self.was_open:
            self.opened = True
            self.instant = self.instant + 1 if self.now - self.asked_at < AT_ONCE_S else 0
        if self.latched and self.was_open and self.now - self._left_open_at < REOPENS_WITHIN_S:
            self.reopened.append(self.now)
        self.was_open = self.latched or self.was_open
        if self._people_at > NOT_YET:
            self._people_open_at = self.now

    def _people_leave(self, at_once: bool) -> None:
        """Note that a door that people had opened closes again."""
        if self._people_at > NOT_YET and self._people_close_at > NOT_YET:
            self.left = True
            self.shut = self.shut + 1 if at_once else 0
        self._people_at = NOT_YET

    def _ask_open(self) -> None:
        if not self.latched:
            self.latched, self.asked_at, self.adapter_closed_at = True, self.now, NOT_YET
            self.was_open, self.was_closed = self.mode == OPEN, self.mode == CLOSED
            self.openings = 0
            self.reopened.clear()
        self.openings += 1
        self.asked_again_at, self.ours = self.now, self.own
        self._people_at = NOT_YET

    def _ask_close(self) -> None:
        if self.latched and self.mode == OPEN:
            self.lapses = 0
        self.latched, self.closed_at = False, self.now
        if self._people_at > NOT_YET and self._people_close_at == NOT_YET:
            self._people_close_at = self.now

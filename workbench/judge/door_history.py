"""The history of a door: its requests and movements."""

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
"""A state may be heard this long (s) after the CLOSE that it has caused."""
DWELLS_S: Final = 0.5
"""No operator releases a door that people have opened sooner than this."""
OPENING_S: Final = 1.0
"""No operator reverses an opening door sooner than this."""


class DoorHistory(History[d.DoorState]):
    """`latched`: the last request was OPEN; `was_closed`: the door was closed then. `asked_at`: the
    first OPEN of this latch; `openings`: OPENs since the door was last seen other than closed, at
    `not_closed_at`. `closed_at`: the last CLOSE on door_requests; `adapter_closed_at`: that of a fleet
    adapter to the supervisor, in this latch. `was_open`: the door has been open in this latch.
    `reopened`: when it reopened at once, in this latch. `instant`: how many times in a row it was OPEN
    as soon as that was requested; `opened`: the latest state is the first OPEN of this latch. `shut`:
    how many times in a row a door that people had opened closed at RMF's CLOSE; `left`: the latest
    state ends such an opening."""

    observes = ObservedDoor

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.latched = self.was_open = self.opened = self.left = self.was_closed = False
        self.asked_at = self.not_closed_at = self.closed_at = self.adapter_closed_at = NOT_YET
        self.openings = 0
        self.reopened: deque[float] = deque(maxlen=3)
        self.instant = 0
        self.shut = 0
        self._left_open_at = NOT_YET
        self._people_at = self._people_open_at = self._people_close_at = NOT_YET

    @property
    def mode(self) -> int:
        """The door's mode now."""
        return self.state.current_mode.value if self.state else -1

    @property
    def mode_before(self) -> int:
        """The mode in the state before; -1 for none."""
        return self.before.current_mode.value if self.before else -1

    @staticmethod
    def claims(state: d.DoorState) -> bool:
        """Is the door OPEN?"""
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
        """Forget requests from before a silence: the node may have restarted."""
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
        """Note that an opening by people has ended."""
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
        self._people_at = NOT_YET

    def _ask_close(self) -> None:
        self.latched, self.closed_at = False, self.now
        if self._people_at > NOT_YET and self._people_close_at == NOT_YET:
            self._people_close_at = self.now

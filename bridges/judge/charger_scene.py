"""What is remembered of a charger: who was promised it, and what it has shown of that."""

from typing import Final

from bridges.judge.scene import NOT_YET, Scene, keep
from bridges.recording.heard import Heard
from bridges.rmf import definitions as d

IDLE: Final = d.ChargerStateValue.CHARGER_IDLE
ASSIGNED: Final = d.ChargerStateValue.CHARGER_ASSIGNED
CHARGING: Final = d.ChargerStateValue.CHARGER_CHARGING
RELEASED: Final = d.ChargerStateValue.CHARGER_RELEASED
ERROR: Final = d.ChargerStateValue.CHARGER_ERROR


class ChargerScene(Scene[d.ChargerState]):
    """`requests`: by id, the latest. `cancels`: id -> when it was first cancelled. `same_since`: since
    when state and request have been as they are. `foreign_at`: the last cancel of an id that the
    station does not show."""

    kind = d.ChargerState

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.requests: dict[str, d.ChargerRequest] = {}
        self.cancels: dict[str, float] = {}
        self.same_since = self.foreign_at = NOT_YET

    def take_other(self, heard: Heard) -> bool:
        """Requests to this charger and their cancels."""
        match heard.message:
            case d.ChargerRequest(charger_name=self.name):
                self.asked()
                keep(self.requests, heard.message.request_id, heard.message)
            case d.ChargerCancel(charger_name=self.name):
                self._cancel(heard.message.request_id)
            case _:
                return False
        return True

    def forget(self) -> None:
        """A silence is over."""
        self.same_since = self.now

    def settle(self, state: d.ChargerState) -> None:
        """Since when it shows this."""
        before = self.before
        if before is None or (before.state, before.request_id) != (state.state, state.request_id):
            self.same_since = self.now

    def _cancel(self, request_id: str) -> None:
        keep(self.cancels, request_id, self.cancels.get(request_id, self.now))
        if self.state is not None and request_id != self.state.request_id:
            self.foreign_at = self.now

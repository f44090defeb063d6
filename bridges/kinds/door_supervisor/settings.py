"""The door supervisor's section of its YAML."""

from collections.abc import Iterable
from typing import Annotated

from bridges.kinds.shared.fields import GraphSettings, Name, Patience, tells
from bridges.kinds.shared.kind import Place
from bridges.kinds.shared.remarks import Remarks


class DoorSupervisorSettings(GraphSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The door supervisor's policy."""

    doors: Annotated[
        list[Name] | None,
        tells("""the doors that the supervisor serves. Messages about other doors are refused. When
        absent, the supervisor serves every door that it hears of, as RMF's supervisor does."""),
    ] = None
    open_alarm_s: Annotated[
        Patience,
        tells("""how long one requester may hold a door open before a fault is shown. The door stays
        open, because the robot may stand in the doorway."""),
    ] = 600.0

    def problems(self) -> Remarks:
        """Yield a problem if the list of doors is empty."""
        if self.doors == []:
            yield ("doors",), "is empty: name the doors, or delete the key to serve every door"


def speaks_of(settings: DoorSupervisorSettings) -> Iterable[Place]:
    """Yield the doors that the supervisor serves."""
    for i, name in enumerate(settings.doors or ()):
        yield ("doors", str(i)), "door", name

"""The door supervisor's section of its YAML."""

from collections.abc import Iterable

from bridges.core.fields import GraphSettings, Name, Patience
from bridges.core.kind import Place


class Settings(GraphSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the door supervisor may decide by itself: nothing but when to complain.

    `doors`: the doors that it serves, whatever names anybody makes up; every door that it hears of when
    absent, as RMF's own does.
    `quiet_start_s`: how long it only listens, so that a restart closes nothing.
    `open_alarm_s`: a fault is shown when one requester has held a door open for so long. The door
    stays open: its robot may stand in the doorway.
    """

    doors: list[Name] | None = None
    open_alarm_s: Patience = 600.0

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """An empty list would serve nobody."""
        if self.doors == []:
            yield ("doors",), "is empty: name the doors, or leave it out to serve every door"


def speaks_of(settings: Settings) -> Iterable[Place]:
    """The doors that it is to serve."""
    for i, name in enumerate(settings.doors or ()):
        yield ("doors", str(i)), "door", name

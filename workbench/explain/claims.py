"""Who asks for a device, for what, since when, and whether they still do."""

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from workbench.explain.phrases import Moment

MOST_CLAIMS: Final = 64
ASKS_WITHIN_S: Final = 3.5
"""A waiting requester repeats itself at each state or each second. After three missed repeats it has
stopped."""
REPEATS_S: Final = 1.5
"""Until we have listened this long, the first request that we hear of somebody may be a repeat."""


@dataclass(slots=True)
class Claim:
    """What one requester asks for. `wants`: a floor, or whatever else. `first`: when its visit began;
    `since`: when it began to ask for this. `times`: how often it asked. `passed_on`: when the
    supervisor last asked for it. `own`: it was heard itself, not only through the supervisor. `met`:
    when RMF saw what it waits for. `granted`: when it had the device. `end_passed_on`: when the
    supervisor passed on its END. `stamp_age_s`: the age by our clock of its last request, if that was
    `stamped`.
    """

    who: str
    wants: str
    first: Moment
    since: Moment
    last: Moment
    times: int = 0
    own: bool = False
    passed_on: Moment | None = None
    granted: Moment | None = None
    met: Moment | None = None
    ended: Moment | None = None
    end_passed_on: bool = False
    gone: bool = False
    stamped: bool = False
    stamp_age_s: float = 0.0

    def asks(self, now: Moment) -> bool:
        """Does it still ask?"""
        return self.ended is None and now.at - self.last.at <= ASKS_WITHIN_S


class Claims:
    """All requesters of one device. A flood of names pushes out the one that was silent the longest.

    `began`: when we began to listen.
    """

    def __init__(self, began: Moment) -> None:
        self._began = began
        self._all: OrderedDict[str, Claim] = OrderedDict()

    def __iter__(self) -> Iterator[Claim]:
        return iter(self._all.values())

    def get(self, who: str) -> Claim | None:
        """The claim of this requester."""
        return self._all.get(who)

    def ask(self, who: str, wants: str, moment: Moment, keep: str = "") -> tuple[Claim, bool]:
        """It asks for this. Returns its claim, and whether it asks for something new. `keep`: who must
        stay."""
        claim = self._all.get(who)
        if claim is None or claim.ended is not None:
            if claim is None and len(self._all) >= MOST_CLAIMS:
                self._make_room(keep)
            since = self._known_since(moment)
            claim = self._all[who] = Claim(who, wants, since, since, moment)
            new = True
        elif new := claim.wants != wants:
            claim.wants, claim.since, claim.met = wants, moment, None
        claim.last, claim.gone = moment, False
        claim.times += 1
        self._all.move_to_end(who)
        return claim, new

    def _known_since(self, moment: Moment) -> Moment:
        early = moment.at - self._began.at < REPEATS_S
        return Moment(moment.at, moment.wall, seen=moment.seen and not early)

    def drop(self, who: str) -> None:
        """It is forgotten."""
        self._all.pop(who, None)

    def _make_room(self, keep: str) -> None:
        oldest = next(who for who in self._all if who != keep)
        del self._all[oldest]

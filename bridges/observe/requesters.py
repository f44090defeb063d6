"""Who asks for a device, for what, since when, and whether they still do."""

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass

from bridges.messages.definitions import Time
from bridges.messages.stamps import in_seconds
from bridges.observe.limits import ASKS_WITHIN_S, GIVEN_UP_S, MOST_REQUESTERS, REPEATS_S


@dataclass(frozen=True, slots=True)
class Moment:
    """When something began. `at`: s on `Heard.at`'s clock. `wall`: s since the epoch. `seen`: False if
    it was so already when the first message came.
    """

    at: float
    wall: float
    seen: bool = True


@dataclass(slots=True)
class Fact:
    """Something that is so, and since when."""

    value: str
    since: Moment

    def say(self, value: str, moment: Moment) -> bool:
        """Set its present value. True if that is a change."""
        if value == self.value:
            return False
        self.value, self.since = value, moment
        return True


@dataclass(slots=True)
class DeviceRequester:
    """What one requester asks for. `wants`: a floor, or whatever else. `first`: when its visit began;
    `since`: when it began to ask for this; `lacks`: since when it has been without it, though it asks;
    `last`: when it asked last. `times`: how often it asked.
    `passed_on`: when the supervisor last asked for it. `own`: it was heard itself, not only through
    the supervisor. `met`: when RMF saw what it waits for. `granted`: when it had the device. `ended`:
    its END; `end_passed_on`: the supervisor passed that on. `gone`: it stopped without END.
    `stamp_age_s`: the age by our clock of its last request, if that was `stamped`.
    """

    who: str
    wants: str
    first: Moment
    since: Moment
    lacks: Moment
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

    def stamp(self, moment: Moment, stamp: Time) -> None:
        """Note how old its request is, by our clock."""
        self.stamped = stamp != Time()
        self.stamp_age_s = moment.wall - in_seconds(stamp)


class DeviceRequesters:
    """All requesters of one device. A flood of names pushes out the one that was silent the longest.

    `began`: when we began to listen.
    """

    def __init__(self, began: Moment) -> None:
        self._began = began
        self._all: OrderedDict[str, DeviceRequester] = OrderedDict()

    def __iter__(self) -> Iterator[DeviceRequester]:
        return iter([*self._all.values()])

    def get(self, who: str) -> DeviceRequester | None:
        """This requester, while its visit lasts."""
        return self._all.get(who)

    def ask(
        self, who: str, wants: str, moment: Moment, keep: str = "", *, stands: bool = False
    ) -> tuple[DeviceRequester, bool]:
        """It asks for this. Returns the requester, and whether it asks for something new. `keep`: who
        must stay. `stands`: no state comes, so nobody repeats itself."""
        found = self._all.get(who)
        if found is not None and not stands and moment.at - found.last.at > GIVEN_UP_S:
            found.ended = found.ended or found.last
        new = found is None or found.ended is not None
        if found is None or found.ended is not None:
            if found is None and len(self._all) >= MOST_REQUESTERS:
                self.drop(next(one for one in self._all if one != keep))
            early = moment.at - self._began.at < REPEATS_S
            since = Moment(moment.at, moment.wall, seen=moment.seen and not early)
            found = self._all[who] = DeviceRequester(who, wants, since, since, since, moment)
        elif new := found.wants != wants:
            found.wants, found.since, found.lacks, found.met = wants, moment, moment, None
        found.last, found.gone = moment, False
        found.times += 1
        self._all.move_to_end(who)
        return found, new

    def drop(self, who: str) -> None:
        """It is forgotten."""
        self._all.pop(who, None)

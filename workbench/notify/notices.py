"""When people are told of a trouble. Pure, with time as an argument.

NOTIFY-1. A trouble is told once, when it has lasted `after_s`. A trouble that comes and goes lasts,
   unless it is gone for `after_s`.
NOTIFY-2. The end of a told trouble is told once, when it has been gone for `over_s`. A trouble that
   comes back earlier is still the same trouble. The trouble of a device that was not heard since the
   start is not gone: nothing is known of it.
NOTIFY-3. In the quiet hours only critical troubles are told. A warning that lasts is told afterwards,
   and the end of a trouble that nobody was told of is not told.
NOTIFY-4. A critical trouble is told again each `again_s` until a person acknowledges it or it ends.
NOTIFY-5. A restart tells nothing twice: the told troubles are kept on disk, and count as told at the
   start.
"""

from collections.abc import Container, Iterable
from dataclasses import dataclass, field, replace
from datetime import time
from typing import Final, Literal

from msgspec import Struct

from workbench.notify.settings import NotifySettings
from workbench.notify.troubles import Trouble

MOST: Final = 1000
"""The most troubles that are remembered; a site has some hundred devices."""
Event = Literal["new", "again", "over"]


@dataclass(frozen=True, slots=True)
class Notice:
    """A message to people. `for_s`: how long the trouble has lasted (s)."""

    event: Event
    trouble: Trouble
    for_s: float


@dataclass(frozen=True, slots=True)
class KnownTrouble:
    """A trouble since `since`, last seen at `seen_at`. `told_at`: the last notice, None before it."""

    trouble: Trouble
    since: float
    seen_at: float
    told_at: float | None = None
    acknowledged: bool = False


class KeptTrouble(Struct, frozen=True):
    """A told trouble on disk."""

    trouble: Trouble
    acknowledged: bool


@dataclass(slots=True)
class Notices:
    """The troubles of a site, and what people were told of them."""

    settings: NotifySettings
    known: dict[str, KnownTrouble] = field(default_factory=dict)

    def turn(
        self, present: Iterable[Trouble], heard: Container[tuple[str, str]], now: float, clock: time
    ) -> list[Notice]:
        """Take the present troubles; return the notices that are due, the most urgent first.

        `heard`: kind and name of each device heard since the start. `clock`: the local time of day.
        """
        for trouble in present:
            before = self.known.get(trouble.key)
            if before is not None:
                self.known[trouble.key] = replace(before, trouble=trouble, seen_at=now)
            elif len(self.known) < MOST:
                self.known[trouble.key] = KnownTrouble(trouble, now, now)
        for key, one in self.known.items():
            if one.seen_at < now and (one.trouble.kind, one.trouble.device) not in heard:
                self.known[key] = replace(one, seen_at=now)
        told = [notice for key in [*self.known] if (notice := self._due(key, now, clock))]
        return sorted(
            told, key=lambda one: (one.trouble.severity != "critical", one.event != "new")
        )

    def kept(self) -> list[KeptTrouble]:
        """Return the told troubles, for the next start."""
        told = (one for one in self.known.values() if one.told_at is not None)
        return [KeptTrouble(one.trouble, one.acknowledged) for one in told]

    def restore(self, kept: Iterable[KeptTrouble], now: float) -> None:
        """Begin with the troubles that an earlier run has told."""
        for one in kept:
            self.known[one.trouble.key] = KnownTrouble(one.trouble, now, now, now, one.acknowledged)

    def acknowledge(self, key: str) -> bool:
        """Repeat this trouble no more; return False if there is no such trouble."""
        found = self.known.get(key)
        if found is not None:
            self.known[key] = replace(found, acknowledged=True)
        return found is not None

    def _due(self, key: str, now: float, clock: time) -> Notice | None:
        one, s = self.known[key], self.settings
        if one.seen_at < now:
            return self._gone(key, now, clock)
        lasts_s = now - one.since
        if lasts_s < s.after_s or self._is_quiet(one, clock):
            return None
        if one.told_at is None:
            event: Event = "new"
        elif _repeats(one, s) and now - one.told_at >= s.again_s:
            event = "again"
        else:
            return None
        self.known[key] = replace(one, told_at=now)
        return Notice(event, one.trouble, lasts_s)

    def _gone(self, key: str, now: float, clock: time) -> Notice | None:
        one, s = self.known[key], self.settings
        patience_s = s.after_s if one.told_at is None else s.over_s
        if now - one.seen_at < patience_s or (
            one.told_at is not None and self._is_quiet(one, clock)
        ):
            return None
        del self.known[key]
        return (
            Notice("over", one.trouble, one.seen_at - one.since)
            if one.told_at is not None
            else None
        )

    def _is_quiet(self, one: KnownTrouble, clock: time) -> bool:
        quiet = self.settings.quiet
        return quiet is not None and one.trouble.severity != "critical" and quiet.contains(clock)


def _repeats(one: KnownTrouble, settings: NotifySettings) -> bool:
    critical = one.trouble.severity == "critical"
    return critical and settings.again_s > 0 and not one.acknowledged

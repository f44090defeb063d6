"""Decide when people get a notice of a trouble. All functions are pure, because time is an argument.

NOTIFY-1. A trouble gets one notice, after the trouble has lasted `after_s`, and another one when its
stage rises. If a trouble goes away and comes back within `after_s`, it counts as present without a
break. NOTIFY-2. The end of a trouble gets
one notice, after the trouble has been gone for `over_s`. Only a trouble that people know from a notice
gets this second notice. A trouble that comes back earlier is still the same trouble. If a device is not
heard now, its trouble is not gone, because nothing is known about the device; then only its silence is
told. NOTIFY-3. In the quiet hours, only critical troubles get a notice. A warning that still lasts gets
its notice after the quiet hours. If a trouble ends before its first notice, the end gets no notice.
NOTIFY-4. A critical trouble gets a notice again every `again_s`. The repeats stop when a person
acknowledges the trouble, or when the trouble ends. NOTIFY-5. After a restart, no notice is lost, and
none is sent twice. The program keeps on disk the reported troubles, and the notices that a recipient
has not taken yet.
"""

from collections.abc import Container, Iterable
from dataclasses import dataclass, field, replace
from datetime import time
from typing import Final, Literal

from msgspec import Struct, structs

from workbench.notify.settings import NotifySettings
from workbench.notify.troubles import SILENT, Trouble

MOST: Final = 1000
"""Maximum number of troubles in memory. A site has some hundred devices."""
Event = Literal["new", "again", "over"]


@dataclass(frozen=True, slots=True)
class Notice:
    """A message to people. `for_s` is the time (s) for which the trouble has lasted."""

    event: Event
    trouble: Trouble
    for_s: float


@dataclass(frozen=True, slots=True)
class KnownTrouble:
    """A trouble that began at `since` and was last seen at `seen_at`. `told_at` is the time of the last
    notice, or None if no notice was sent. `told_stage` is the trouble's stage at that time."""

    trouble: Trouble
    since: float
    seen_at: float
    told_at: float | None = None
    told_stage: int = 0
    acknowledged: bool = False


class KeptTrouble(Struct, frozen=True):
    """A trouble on disk that was already reported to people. Its stage is the one of the last notice.
    `since` is the wall time (s)."""

    trouble: Trouble
    acknowledged: bool
    since: int


@dataclass(slots=True)
class Notices:
    """The troubles of a site. Each trouble remembers whether people have got a notice of it."""

    settings: NotifySettings
    known: dict[str, KnownTrouble] = field(default_factory=dict)

    def turn(
        self, present: Iterable[Trouble], heard: Container[tuple[str, str]], now: float, clock: time
    ) -> list[Notice]:
        """Take the present troubles. Return the notices that are due, the most urgent first.

        `heard` has the kind and name of each device about which something is known now. `clock` is the
        local time of day.
        """
        for trouble in present:
            before = self.known.get(trouble.key)
            if before is not None:
                told_stage = min(before.told_stage, trouble.stage)
                self.known[trouble.key] = replace(
                    before, trouble=trouble, seen_at=now, told_stage=told_stage
                )
            elif len(self.known) < MOST:
                self.known[trouble.key] = KnownTrouble(trouble, now, now)
        unheard = set()
        for key, one in self.known.items():
            if one.seen_at < now and (one.trouble.kind, one.trouble.device) not in heard:
                self.known[key] = replace(one, seen_at=now)
                if one.trouble.what != SILENT:
                    unheard.add(key)
        due = [key for key in self.known if key not in unheard]
        told = [notice for key in due if (notice := self._due(key, now, clock))]
        return sorted(
            told, key=lambda one: (one.trouble.severity != "critical", one.event != "new")
        )

    @property
    def silent(self) -> set[tuple[str, str]]:
        """The kind and name of each device whose silence is known."""
        known = (one.trouble for one in self.known.values())
        return {(one.kind, one.device) for one in known if one.what == SILENT}

    def kept(self, ahead_s: float) -> list[KeptTrouble]:
        """Return the troubles already reported to people, for the next start. `ahead_s`: the wall time
        minus the time (s) of `turn`."""
        return [
            KeptTrouble(
                structs.replace(one.trouble, stage=one.told_stage),
                one.acknowledged,
                round(one.since + ahead_s),
            )
            for one in self.known.values()
            if one.told_at is not None
        ]

    def restore(self, kept: Iterable[KeptTrouble], now: float, ahead_s: float) -> None:
        """Begin with the troubles that an earlier run reported to people."""
        for one in kept:
            since = min(one.since - ahead_s, now)
            stage = one.trouble.stage
            known = KnownTrouble(one.trouble, since, now, now, stage, one.acknowledged)
            self.known[one.trouble.key] = known

    def acknowledge(self, key: str) -> bool:
        """Stop repeating this trouble. Return False if there is no such trouble."""
        found = self.known.get(key)
        if found is not None:
            self.known[key] = replace(found, acknowledged=True)
        return found is not None

    def _due(self, key: str, now: float, clock: time) -> Notice | None:
        one, s = self.known[key], self.settings
        if one.seen_at < now:
            return self._gone(key, now, clock)
        lasts_s = one.trouble.before_s + now - one.since
        if lasts_s < s.after_s or self._is_quiet(one, clock):
            return None
        if one.told_at is None or one.trouble.stage > one.told_stage:
            event: Event = "new"
        elif _repeats(one, s) and now - one.told_at >= s.again_s:
            event = "again"
        else:
            return None
        self.known[key] = replace(
            one, told_at=now, told_stage=one.trouble.stage, acknowledged=False
        )
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
            Notice("over", one.trouble, one.trouble.before_s + one.seen_at - one.since)
            if one.told_at is not None
            else None
        )

    def _is_quiet(self, one: KnownTrouble, clock: time) -> bool:
        quiet = self.settings.quiet
        return quiet is not None and one.trouble.severity != "critical" and quiet.contains(clock)


def _repeats(one: KnownTrouble, settings: NotifySettings) -> bool:
    critical = one.trouble.severity == "critical"
    return critical and settings.again_s > 0 and not one.acknowledged

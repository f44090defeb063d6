"""Check one device's messages against the laws of the device's kind. A fleet adapter also counts as a
device."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final, Literal

from bridges.messages import words
from bridges.messages.heard import Heard
from bridges.observe.limits import SLOWEST_S
from workbench.judge import (
    adapter_laws,
    alarm_laws,
    charger_laws,
    door_laws,
    lift_laws,
    workcell_laws,
)
from workbench.judge.adapter_history import AdapterHistory
from workbench.judge.alarm_history import AlarmHistory
from workbench.judge.charger_history import ChargerHistory
from workbench.judge.door_history import DoorHistory
from workbench.judge.history import AnyHistory
from workbench.judge.law import Doubt, Evidence, JudgedLaw, Law, Verdict
from workbench.judge.lift_history import LiftHistory
from workbench.judge.workcell_history import DispenserHistory, IngestorHistory

JudgedKind = words.Kind | Literal["adapter", "alarm"]
KINDS: Final[tuple[JudgedKind, ...]] = (*words.KINDS, "adapter", "alarm")
LAWS: Final[Mapping[JudgedKind, tuple[Law[Any], ...]]] = MappingProxyType(
    {
        "lift": lift_laws.LAWS,
        "door": door_laws.LAWS,
        "charger": charger_laws.LAWS,
        "dispenser": workcell_laws.LAWS,
        "ingestor": workcell_laws.LAWS,
        "adapter": adapter_laws.LAWS,
        "alarm": alarm_laws.LAWS,
    }
)
SCENES: Final[Mapping[JudgedKind, Callable[[str], AnyHistory]]] = MappingProxyType(
    {
        "lift": LiftHistory,
        "door": DoorHistory,
        "charger": ChargerHistory,
        "dispenser": DispenserHistory,
        "ingestor": IngestorHistory,
        "adapter": AdapterHistory,
        "alarm": AlarmHistory,
    }
)
MUTE_S: Final = 10.0
"""Time (s) without a state after which a publisher counts as mute. RMF uses the same time."""
SHOWN: Final = 3
"""Maximum number of breaches that a law keeps as evidence."""


@dataclass
class _Tally:
    """The score of one law. `doubt` is a possible breach with its evidence. A later message may still
    show that it was no breach."""

    law: Law[Any]
    kept: int = 0
    broken: int = 0
    evidence: list[Evidence] = field(default_factory=list)
    doubt: tuple[Doubt, Evidence] | None = None

    def found(self, heard: Evidence) -> None:
        """Count a breach."""
        self.broken += 1
        if len(self.evidence) < SHOWN:
            self.evidence.append(heard)

    def judged(self) -> JudgedLaw:
        """Return the law with its verdict."""
        if self.broken:
            return JudgedLaw(self.law, Verdict.BROKEN, self.broken, tuple(self.evidence))
        return JudgedLaw(self.law, Verdict.KEPT if self.kept else Verdict.NOT_SEEN, self.kept)


class Judge:
    """A judge of one device. Its memory is limited. `name` is the device's name in RMF.

    - `only`: the ids of the laws to check; empty means all laws of the kind.
    - `broken`: whether the device has broken a law of `only`.
    """

    def __init__(self, kind: JudgedKind, name: str, only: Iterable[str] | None = None) -> None:
        ids = {law.id for law in LAWS[kind]} if only is None else set(only)
        self.kind: JudgedKind = kind
        self.name = name
        self.history = SCENES[kind](name)
        self.first: Heard | None = None
        self.broken = False
        self._heard_at = float("-inf")
        self._volatile_before: bool | None = None
        self._tallies = [_Tally(law) for law in LAWS[kind] if law.id in ids]

    def hear(self, heard: Heard, own: bool = False) -> None:
        """Take the next message of any device, in order of arrival. `own` tells whether the judge
        published the message."""
        self.first = self.first or heard
        if not own:
            self._pass_silence(heard.at)
        if self.history.take(heard, own):
            for tally in self._tallies:
                self._check(tally, heard.at, heard.wall)
            self.history.checked()
        self._resolve()

    def alarm_ends(
        self, names: Collection[str], retaining: Collection[str], at: float, wall: float
    ) -> None:
        """Tell the judge which nodes publish alarms (`names`), and which of them retain their messages
        (`retaining`). The judge believes only what two calls in a row tell, because publishers are
        discovered one by one."""
        history = self.history
        if not isinstance(history, AlarmHistory | LiftHistory):
            return
        if isinstance(history, AlarmHistory):
            history.hears = True
        node = history.publisher if isinstance(history, LiftHistory) else history.name
        ours = _plain([node]) & _plain(names)
        found = bool(ours - _plain(retaining)) if ours else None
        history.volatile = found if found == self._volatile_before else None
        self._volatile_before = found
        for tally in self._tallies:
            if tally.law.id in ("L12.retained", "A3.retained"):
                self._check(tally, at, wall)

    def end(self, at: float, wall: float, heard_s: float = 0.0) -> tuple[JudgedLaw, ...]:
        """End the judgement. `heard_s` is for how long (s) the judge has listened. Return each law with
        its verdict, in the laws' order."""
        self.history.pass_time(at, wall)
        mute = heard_s > MUTE_S and len(self.history.senders) > len(self.history.others)
        if self.history.states or mute:
            for tally in self._tallies:
                self._check(tally, at, wall)
        return self.verdicts()

    def verdicts(self) -> tuple[JudgedLaw, ...]:
        """Return each law with its present verdict."""
        return tuple(tally.judged() for tally in self._tallies)

    def _breaks(self, tally: _Tally, evidence: Evidence) -> None:
        self.broken = True
        tally.found(evidence)

    def _check(self, tally: _Tally, at: float, wall: float) -> None:
        finding = tally.law.check(self.history)
        if finding is None:
            return
        if isinstance(finding, Doubt):
            tally.doubt = tally.doubt or (finding, Evidence(at, wall, finding.text))
        elif finding:
            self._breaks(tally, Evidence(at, wall, finding))
        else:
            tally.kept += 1

    def _pass_silence(self, now: float) -> None:
        """Drop every doubt after a silence of the whole network, because the message that would excuse
        it may be lost."""
        if now - self._heard_at > SLOWEST_S:
            for tally in self._tallies:
                tally.doubt = None
        self._heard_at = now

    def _resolve(self) -> None:
        """Decide the doubts that are old enough. Only messages of other nodes show that the network
        still delivers, so time without them decides nothing."""
        for tally in self._tallies:
            if tally.doubt is None:
                continue
            doubt, evidence = tally.doubt
            if doubt.excused():
                tally.doubt = None
            elif self._heard_at - evidence.at > doubt.leeway_s:
                tally.doubt = None
                self._breaks(tally, evidence)


def _plain(names: Iterable[str]) -> set[str]:
    """Return the nodes' names without the slash of their namespace."""
    return {name.lstrip("/") for name in names}

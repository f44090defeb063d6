"""The lift's relays from scan to scan. After it was switched off, a relay stays off for a minimum time.
It is switched on at most a certain number of times per minute. Calls and door commands exclude each
other. Switching off never waits.

A decision switches an output, but a bus may be slow or lose the write. Therefore a relay counts as
switched off only from the first reading after a scan whose write succeeded."""

import math
from collections.abc import Iterator
from typing import Any, Generic, TypeVar

import msgspec
from msgspec.structs import replace

from bridges.kinds.lift.settings import LiftDurations
from bridges.kinds.lift.signals import LiftOutputs, Side
from bridges.kinds.shared.durations import AGES_AGO, NEVER

T = TypeVar("T")


class Channel(msgspec.Struct, Generic[T], frozen=True):
    """One output, or a group of outputs of which at most one is on.

    `on`: the output that is on now. `off_at`: the time of the last switching off. `ons`: the latest
    times of switching on. `written`: False until the last switching has been written.
    """

    on: T | None = None
    off_at: float = AGES_AGO
    ons: tuple[float, ...] = ()
    written: bool = True

    def step(self, wanted: T | None, now: float, ready_at: float, t: LiftDurations) -> "Channel[T]":
        """Return the next state. Switching off is immediate. Switching on waits until the relay has
        been off for long enough, and until `ready_at`. A change to another output of the group waits
        too."""
        if self.on is not None:
            if wanted == self.on:
                return self
            return replace(self, on=None, off_at=now, written=False)
        if wanted is None or now < self.may_switch_on_at(now, ready_at, t):
            return self
        return Channel(wanted, self.off_at, (*self.recent(now), now), written=False)

    def confirm(self, now: float) -> "Channel[T]":
        """Return the state after the last switching was written. The rest of a relay begins now."""
        if self.written:
            return self
        return replace(self, off_at=now if self.on is None else self.off_at, written=True)

    @property
    def switched_at(self) -> float:
        """The time of the last switching."""
        return self.off_at if self.on is None else self.ons[-1]

    @property
    def rests_from(self) -> float:
        """The time from which the relay rests; NEVER while its switching off is not written."""
        return self.off_at if self.written or self.on is not None else NEVER

    def recent(self, now: float) -> tuple[float, ...]:
        """Return the times of switching on within the last minute."""
        return tuple(at for at in self.ons if now - at < 60.0)

    def may_switch_on_at(self, now: float, ready_at: float, t: LiftDurations) -> float:
        """Return the earliest time at which an output may be energised."""
        recent = self.recent(now)
        most = t.max_cycles_per_min
        rested_at = recent[-most] + 60.0 if len(recent) >= most else AGES_AGO
        return max(self.rests_from + t.min_off_s, ready_at, rested_at)


class Relays(msgspec.Struct, frozen=True):
    """Every output, with the times at which it was switched. A call and a door command are never on
    together."""

    agv: Channel[bool] = Channel()
    call: Channel[str] = Channel()
    hold: Channel[Side] = Channel()

    def outputs(self) -> LiftOutputs:
        """Return the outputs for the driver to write."""
        return LiftOutputs(bool(self.agv.on), self.call.on, self.hold.on)

    def step(self, wanted: LiftOutputs, now: float, t: LiftDurations) -> "Relays":
        """Move every output towards the wanted state, as far as the limits allow now."""
        agv = self.agv.step(wanted.agv_request or None, now, AGES_AGO, t)
        rested_at = self._rested_at(t) if agv.on else NEVER
        call_ready_at = NEVER if self.hold.on else rested_at
        call = self.call.step(wanted.call, now, call_ready_at, t)
        hold_ready_at = NEVER if self.call.on or call.on else rested_at
        hold = self.hold.step(wanted.hold_door, now, hold_ready_at, t)
        return Relays(agv, call, hold)

    def confirm(self, now: float) -> "Relays":
        """Return the relays after every output was written."""
        return Relays(self.agv.confirm(now), self.call.confirm(now), self.hold.confirm(now))

    def read_at(self) -> float:
        """Return the time for the reading that confirms the last switching, which is at once."""
        channels: tuple[Channel[Any], ...] = (self.agv, self.call, self.hold)
        at = max((one.switched_at for one in channels if not one.written), default=NEVER)
        return math.nextafter(at, NEVER)

    def changes_at(self, wanted: LiftOutputs, now: float, t: LiftDurations) -> float:
        """Return the next time, later than `now`, when a wanted output may come on."""
        off = self._still_off(wanted, now, t)
        due = [channel.may_switch_on_at(now, ready_at, t) for _, channel, ready_at in off]
        return max(min(due, default=NEVER), math.nextafter(now, NEVER))

    def resting(self, wanted: LiftOutputs, now: float, t: LiftDurations) -> tuple[str, bool]:
        """Return the first wanted output that must rest, "" for none. Also return whether
        `max_cycles_per_min` is the reason."""
        for name, channel, ready_at in self._still_off(wanted, now, t):
            unused = replace(channel, ons=())
            at = channel.may_switch_on_at(now, ready_at, t)
            return name, at > unused.may_switch_on_at(now, ready_at, t)
        return "", False

    def _still_off(
        self, wanted: LiftOutputs, now: float, t: LiftDurations
    ) -> Iterator[tuple[str, Channel[Any], float]]:
        """Yield (name, channel, ready_at) of each wanted output that is off.

        `ready_at`: this output may come on from this time, as far as the other outputs are concerned.
        """
        agv_at = now if self.agv.on else self.agv.may_switch_on_at(now, AGES_AGO, t)
        ready_at = max(agv_at, self._rested_at(t))
        if wanted.agv_request and not self.agv.on:
            yield "AGV mode", self.agv, AGES_AGO
        if wanted.call and not self.call.on:
            yield "the call", self.call, ready_at
        if wanted.hold_door and not self.hold.on:
            yield "the door", self.hold, ready_at

    def _rested_at(self, t: LiftDurations) -> float:
        """Return the time when the call and the door command have both been off for `dead_time_s`."""
        return max(self.call.rests_from, self.hold.rests_from) + t.dead_time_s

"""Troubles and their repair. Both depend on the seed alone.

Troubles come in groups. In each group a few parts break within a minute, and each part is repaired some
time later. Then comes a time without troubles. Sometimes it is so long that every robot's wait must end
within it.

After the repair of a wire or a part the technician resets the device (`rmf-bridge reset`). The same
holds after an alarm that stays latched. After a restart, a network cut, a lost bus, or a hazard that
ends by itself, nobody resets the device.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from random import Random
from typing import Protocol

from bridges.kinds.lift.signals import Hazard
from hal_fakes.plants.charger import CAUSES, ChargerPlant
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.lift import FAILS, LiftPlant
from hal_fakes.plants.plant import FailureMode
from tests.site.building import Device
from tests.site.timeline import NEVER, Timeline

WIRE_MODES: tuple[FailureMode, ...] = ("off", "stuck", "slow", "garbage", "wrong")
LIES: tuple[FailureMode, ...] = ("stuck", "slow", "garbage", "wrong")
RESET = ", to be reset"
BY_RESET_S = 4.0
"""The time (s) from a repair to a healthy device. In that time hazards end and the technician
resets."""
LIFT_HAZARDS = ("fire_alarm", "code_blue", "manual_mode", "earthquake")


class Ills:
    """The troubles (ills) of devices, supervisors and robots: the start of each present ill, and the
    end of each past ill.

    The argument `device` may also be the name of a supervisor or a robot.
    """

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self._now: dict[str, dict[str, float]] = {}
        self._over: dict[str, dict[str, float]] = {}
        self._well_at: dict[str, float] = {}
        self._modes: dict[tuple[str, str], FailureMode] = {}
        self._obstructed: dict[str, float] = {}
        self._calm_at = 0.0

    def begin(self, device: str, what: str, mode: FailureMode | None = None) -> None:
        """Note the start of an ill."""
        self._now.setdefault(device, {})[what] = self._timeline.now
        if mode is not None:
            self._modes[device, what] = mode

    def end(self, device: str, what: str) -> None:
        """Note the end of an ill."""
        del self._now[device][what]
        self._over.setdefault(device, {})[what] = self._timeline.now
        self._well_at[device] = self._calm_at = self._timeline.now

    def has(self, device: str, what: str) -> bool:
        """Return whether the device has this ill."""
        return what in self._now.get(device, {})

    def any(self, device: str) -> bool:
        """Return whether the device has any ill."""
        return bool(self._now.get(device))

    def since(self, device: str, what: str) -> float:
        """Return the start of this ill. Without this ill return inf."""
        return self._now.get(device, {}).get(what, NEVER)

    def since_over(self, device: str, *what: str) -> float:
        """Return the end of the last of these ills."""
        over = self._over.get(device, {})
        return max(over.get(one, -NEVER) for one in what)

    def well_since(self, device: str) -> float:
        """Return the end of the device's last ill. During an ill return inf."""
        if self.any(device):
            return NEVER
        return self._well_at.get(device, -NEVER)

    def lying(self, device: str, settles_s: float) -> Iterator[str]:
        """Yield the wires and parts that give wrong values now, or did so in the last `settles_s`
        seconds."""
        for (name, what), mode in self._modes.items():
            if name != device or mode not in LIES:
                continue
            over_at = self._over.get(device, {}).get(what, -NEVER)
            if self.has(device, what) or over_at + settles_s > self._timeline.now:
                yield what

    def hazard_since(self, device: str) -> float:
        """Return the time from which the daemon could see a hazard, because the hazard's wire works.
        Without such a hazard return inf."""
        now, over = self._now.get(device, {}), self._over.get(device, {})
        return min(
            (
                max(since, over.get(what.removeprefix("hazard "), -NEVER))
                for what, since in now.items()
                if what.startswith("hazard ")
                and not what.endswith(RESET)
                and what.removeprefix("hazard ") not in now
            ),
            default=NEVER,
        )

    def obstruct(self, device: str) -> None:
        """Note that a person stands in the doorway from now on."""
        self._obstructed[device] = self._timeline.now

    def obstructed_since(self, device: str) -> float:
        """Return the time at which a person stepped into the doorway. Without a person return NEVER."""
        return self._obstructed.get(device, NEVER)

    def calm_since(self) -> float:
        """Return the end of the last ill of any party. During an ill return inf."""
        return NEVER if any(self._now.values()) else self._calm_at

    def all(self) -> list[str]:
        """Return all present ills."""
        return [f"{device}: {what}" for device, ills in self._now.items() for what in ills]


class Mortal(Protocol):
    """A party that can be killed and started."""

    name: str
    alive: bool

    def start(self) -> None: ...

    def kill(self) -> None: ...


@dataclass(frozen=True)
class Ill:
    """One possible trouble of a device, supervisor or robot. The functions `begin` and `end` start and
    end it. It lasts from `least_s` to `most_s` (s).

    `sort` is the name under which the day counts this trouble. `reset` is the technician's action after
    the repair, and returns whether it had an effect. If the trouble lasted at most `heals_s` (s), the
    device recovers without a reset. `exact`: the trouble itself ends after `least_s`, so it never lasts
    longer.
    """

    sort: str
    device: str
    what: str
    begin: Callable[[], None]
    end: Callable[[], None]
    least_s: float = 3.0
    most_s: float = 90.0
    mode: FailureMode | None = None
    reset: Callable[[], bool] | None = None
    heals_s: float = 0.0
    exact: bool = False


class Trouble:
    """The troubles of a day, in groups. `draw` returns a trouble that may begin now."""

    def __init__(
        self,
        timeline: Timeline,
        ills: Ills,
        random: Random,
        draw: Callable[[Random], Ill],
        note: Callable[[str], None],
    ) -> None:
        self.counts: dict[str, int] = {}
        self.over_at = NEVER
        self._timeline = timeline
        self._ills = ills
        self._random = random
        self._draw = draw
        self._note = note

    def begin(self, until: float) -> None:
        """Begin the first group. More groups follow. No trouble lasts longer than until the time
        `until`."""
        self.over_at = until
        self._timeline.after(self._random.uniform(20.0, 60.0), self._bout)

    def _bout(self) -> None:
        random, now = self._random, self._timeline.now
        last = now
        for _ in range(random.randint(3, 10)):
            at = now + random.uniform(0.0, 60.0)
            lasts = self._strike(at)
            last = max(last, lasts)
        calm_s = random.uniform(5.0, 45.0) if random.random() < 0.75 else random.uniform(310, 350)
        if last + calm_s + 120.0 < self.over_at:
            self._timeline.at(last + calm_s, self._bout)

    def _strike(self, at: float) -> float:
        """Draw a trouble that begins at this time. Return the time of its repair."""
        ill = self._draw(self._random)
        lasts_s = self._random.uniform(ill.least_s, ill.most_s)
        if self._random.random() < 0.1 and not ill.exact:
            lasts_s *= 3.0
        end = min(at + lasts_s, self.over_at)
        if at >= end:
            return at
        self._timeline.at(at, lambda: self._begin(ill, end))
        return end + BY_RESET_S

    def _begin(self, ill: Ill, end: float) -> None:
        again = f"{ill.what}{RESET}"
        if self._ills.has(ill.device, ill.what) or self._ills.has(ill.device, again):
            return
        self.counts[ill.sort] = self.counts.get(ill.sort, 0) + 1
        self._note(f"--- {ill.device}: {ill.what} {ill.mode or ''}")
        self._ills.begin(ill.device, ill.what, ill.mode)
        ill.begin()
        begun = self._timeline.now
        self._timeline.at(end, lambda: self._end(ill, begun))

    def _end(self, ill: Ill, begun: float) -> None:
        self._note(f"--- {ill.device}: {ill.what} is mended")
        ill.end()
        self._ills.end(ill.device, ill.what)
        broken_s = self._timeline.now - begun
        if ill.reset is not None and broken_s > ill.heals_s:
            self._ills.begin(ill.device, f"{ill.what}{RESET}")
            self._timeline.after(BY_RESET_S, lambda: self._reset(ill))

    def _reset(self, ill: Ill) -> None:
        """Reset the device as a technician does. If the device is silent, or if the reset has no
        effect, try again later."""
        assert ill.reset is not None
        silent = self._ills.has(ill.device, "bus") or self._ills.has(ill.device, "daemon")
        if silent or not ill.reset():
            self._timeline.after(BY_RESET_S, lambda: self._reset(ill))
            return
        self._ills.end(ill.device, f"{ill.what}{RESET}")


Breakable = list[tuple[str, tuple[FailureMode, ...]]]


def breakable(device: Device) -> tuple[Breakable, Breakable]:
    """Return the wires and the parts of a device, each with its possible failures."""
    plant = device.plant
    wires = [(signal, WIRE_MODES) for signal in (*plant._sensors, *plant._relays)]
    if isinstance(plant, LiftPlant):
        return wires, [(p, m) for p, m in FAILS.items() if not p.startswith("rear")]
    if isinstance(plant, DoorPlant):
        return wires, [("operator", WIRE_MODES)]
    assert isinstance(plant, ChargerPlant)
    return wires, [(part, WIRE_MODES) for part in ("receiver", "server", "headers", "body")]


def pressable(device: Device) -> list[str]:
    """Return the actions of people at a device that count as ills."""
    plant = device.plant
    if isinstance(plant, LiftPlant):
        return [h for h in LIFT_HAZARDS if Hazard(h) in plant.pressed]
    if isinstance(plant, DoorPlant):
        return ["obstruction", *(["fire"] if "fire" in plant._sensors else [])]
    return list(CAUSES)

"""A simulated lift with its controller: car, doors, AGV key logic, people, and the hazards that take
the lift away from RMF.

- AGV mode begins some time after its request, when people's calls are done, and never under a hazard.
  AGV mode ends when the request ends or a hazard comes.
- With `agv_mode: by_call` a call requests AGV mode. The request ends when a door has opened for the
  call, and no relay holds a door or calls a landing (as in open-rmf/mock-lift-io,
  firmware/Mock-Lift/src/main.cpp).
- In AGV mode a call brings the car to its landing, and the door opens. The door stays open for its
  dwell time, and as long as its open relay is on. The car leaves only with its doors closed.
- Fire: the car goes to the lowest landing and stays there with its door open. Emergency and earthquake:
  the car stops at the next landing and opens. Code blue, out of service and manual: AGV mode ends, and
  nothing else happens.
- If AGV mode is lost on the way, the car stops at the next landing and opens for its dwell time.
- Overload: the car stays at its landing with its door open.

The signals to press are each wired hazard, `hall_<landing>` (a person's call), `obstruction` and
`rear_obstruction`.

These parts can fail, with these effects. Wires fail as in `hal_fakes/plants/contact.py`.

- `car`: in the modes `off` and `stuck` the car stands still. In `slow` it is slow, and in `wrong` it
  goes a floor too far.
- `door_operator` and `rear_door_operator`: in the modes `off` and `stuck` the door stands still. In
  `slow` it is slow, and in `wrong` it does the opposite of each command.
- `controller`: in the mode `off` it never grants AGV mode. In `stuck` it leaves AGV mode unchanged, and
  in `slow` it is slow.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from bridges.kinds.lift.signals import Hazard, Side
from drivers.lift import codes
from drivers.lift.dry_contact import DryContactLiftSettings, wires
from drivers.lift.table import input_rows
from hal_fakes.fake import Fake
from hal_fakes.plants.lift_car import NEVER, Car, CarDoor
from hal_fakes.plants.machine import WiredPlant
from hal_fakes.plants.plant import FailureMode

CALL_SETTLES_S = 0.05
SLOWNESS = 5.0
PREFIX = {Side.FRONT: "", Side.REAR: "rear_"}
OPENS_UP = (Hazard.EMERGENCY, Hazard.EARTHQUAKE)

FAILS: dict[str, tuple[FailureMode, ...]] = {
    "car": ("off", "stuck", "slow", "wrong"),
    "door_operator": ("off", "stuck", "slow", "wrong"),
    "rear_door_operator": ("off", "stuck", "slow", "wrong"),
    "controller": ("off", "stuck", "slow"),
}


@dataclass(frozen=True, slots=True)
class LiftPace:
    """The lift's durations (s): a floor's travel, a door's travel, the granting of AGV mode, and the
    time that a door stays open at a landing."""

    floor_s: float = 2.0
    door_s: float = 1.0
    agv_s: float = 0.5
    dwell_s: float = 3.0


def build(name: str, settings: DryContactLiftSettings) -> "LiftPlant":
    """Build the lift wired to these settings."""
    return LiftPlant(name, settings)


class LiftPlant(WiredPlant):
    """One lift. At the start the car stands at its lowest landing with its doors closed."""

    def __init__(
        self,
        name: str,
        settings: DryContactLiftSettings,
        pace: LiftPace | None = None,
        links: Sequence[str] = (),
    ) -> None:
        """Make the lift. `links` are further parts that can fail, such as those of a wire to the
        controller."""
        self.car = Car()
        self.agv = False
        self._wiring = settings
        self._pace = pace or LiftPace()
        self._levels = settings.levels()
        self._sides = {level: _sides(settings, level) for level in self._levels}
        self.doors = {side: CarDoor() for sides in self._sides.values() for side in sides}
        parts = [p for p in FAILS if p != "rear_door_operator" or Side.REAR in self.doors]
        super().__init__(name, wires(settings), [*parts, *links], _buttons(settings, self.doors))
        self._only_in_agv = {s for s, _, line in input_rows(settings) if line.valid_when}
        self._on: set[str] = set()
        self._people: list[int] = []
        self._let_out = False
        self._call: int | None = None
        self._called_for_agv = False
        self._seen: int | None = None
        self._seen_at = NEVER
        self._grant_at = NEVER
        self._code: dict[str, bool] = {}
        self._asserted: dict[str, bool] = {}

    # ---- WiredPlant's methods

    def contact(self, signal: str) -> bool:
        """Is this contact asserted at the controller? The contact's wire may show another value."""
        return self._asserted.get(signal, False)

    def actuate(self, signal: str, energised: bool) -> None:
        """React to a change of the daemon's relay. A call counts only after its relay has been stable
        for a moment."""
        (self._on.add if energised else self._on.discard)(signal)
        if signal.startswith("call_"):
            self._seen, self._seen_at = self._called(), self.now + CALL_SETTLES_S

    def act(self, signal: str, asserted: bool) -> None:
        """Call the car to a landing as a person does. In AGV mode this has no effect."""
        if signal.startswith("hall_") and asserted and not self.agv:
            self._people.append(self._levels.index(signal.removeprefix("hall_")))

    def fail(self, part: str, mode: FailureMode | None) -> None:
        """Let a wire or part fail in this mode. The mode None repairs the part. Raises ValueError with
        the known names."""
        if mode is not None and mode not in FAILS.get(part, (mode,)):
            raise ValueError(f"{part} does not fail by {mode!r}, but by {', '.join(FAILS[part])}")
        super().fail(part, mode)

    def run(self) -> None:
        """Run all due events, then the effects that follow from the events."""
        for door in self.doors.values():
            door.run(self.now)
        self._take_call()
        self.car.run(self.now, self._goal(), self._floor_s())
        self._arrive()
        self._grant()  # the arrival may allow AGV mode, and AGV mode may accept a waiting call
        self._arrive()
        for side, door in self.doors.items():
            turned = self.failures.get(f"{PREFIX[side]}door_operator") == "wrong"
            opens = self._open(side) != (turned and self.car.standing)
            door.steer(self.now, opens, self._door_s(side))
        self._depart()
        self._asserted = self._lines()

    def event_at(self) -> float:
        """Return the time of the next event of car, doors or controller."""
        dwells = [d.dwell_until for d in self.doors.values() if d.dwell_until > self.now]
        doors = [d.due_at for d in self.doors.values()]
        return min([self.car.event_at(), self._grant_at, self._seen_at, *doors, *dwells])

    # ---- the controller

    def _hazard(self, *hazards: Hazard) -> bool:
        return any(self.pressed.get(h, False) for h in hazards)

    def _called(self) -> int | None:
        """Return the landing whose call is on. Return None without a call, and for a code that stands
        for no landing."""
        code = self._wiring.call_code
        for i, level in enumerate(self._levels):
            lines = code.lines(level) if code else {f"call_{level}": True}
            on = {s for s in self._on if s.startswith("call_")}
            if on and on == {s for s, asserted in lines.items() if asserted}:
                return i
        return None

    def _take_call(self) -> None:
        if self._seen_at <= self.now:
            self._seen_at = NEVER
            # AGV mode serves the call, and the call also requests AGV mode.
            if self._seen is not None:
                self._call = self._seen
                self._called_for_agv = True

    def _grant(self) -> None:
        """Grant AGV mode after some time. End AGV mode at once."""
        failure = self.failures.get("controller")
        taken = self._hazard(*(h for h in Hazard if h is not Hazard.OVERLOAD))
        asked = self._asked() and not taken and failure != "off"
        if failure == "stuck":
            self._grant_at = NEVER
        elif self.agv and not asked:
            self.agv = False
            self._let_out = not self.car.standing
        elif self.agv or not asked or self._people or not self.car.standing:
            self._grant_at = NEVER
        elif self._grant_at == NEVER:
            slowness = SLOWNESS if failure == "slow" else 1.0
            self._grant_at = self.now + self._pace.agv_s * slowness
        elif self._grant_at <= self.now:
            self.agv, self._grant_at = True, NEVER
            if self._wiring.agv_mode == "requested":
                self._call = self._called()

    def _asked(self) -> bool:
        """Does a relay of the daemon request AGV mode?"""
        if self._wiring.agv_mode == "requested":
            return "agv_mode_request" in self._on
        held = bool(self._on & {"door_open", "rear_door_open"}) or self._called() is not None
        served = self._call is None and any(door.opened for door in self.doors.values())
        taken_away = self._hazard(*(h for h in Hazard if h is not Hazard.OVERLOAD))
        if taken_away or (served and not held):
            self._called_for_agv, self._call = False, None
        return self._called_for_agv

    def _goal(self) -> int | None:
        """Return the landing to drive to. None means the next landing where the car can stop."""
        if self._hazard(Hazard.FIRE):
            return 0
        if self._hazard(*OPENS_UP):
            return None
        goal = self._call if self.agv else next(iter(self._people), None)
        if goal is not None and self.failures.get("car") == "wrong":
            return goal + 1 if goal + 1 < len(self._levels) else goal - 1
        return goal

    def _arrive(self) -> None:
        """End the call at the goal, and open the door there for its dwell time."""
        goal = self._goal()
        if not self.car.standing or not (self._let_out or self.car.floor == goal):
            return
        self._let_out = False
        if self._hazard(Hazard.FIRE):
            return
        if self.car.floor == goal:
            self._call = None if self.agv else self._call
            del self._people[:1]
        sides = self._sides[self._levels[self.car.floor]]
        if len(sides) == 1 or not self.agv:  # otherwise only the daemon's relays open a door
            for side in sides:
                self.doors[side].dwell_until = self.now + self._pace.dwell_s

    def _open(self, side: Side) -> bool:
        """Should this door be open, or opening?"""
        door = self.doors[side]
        here = self.car.standing and side in self._sides[self._levels[self.car.floor]]
        if not here:
            return False
        if not door.closed and self.pressed[f"{PREFIX[side]}obstruction"]:
            return True
        if self._hazard(Hazard.FIRE):
            return self.car.floor == 0
        if self._hazard(*OPENS_UP) or (self._hazard(Hazard.OVERLOAD) and not door.closed):
            return True
        held = self.agv and f"{PREFIX[side]}door_open" in self._on
        return held or self.now < door.dwell_until

    def _depart(self) -> None:
        goal = self._goal()
        ready = self.car.standing and all(d.closed for d in self.doors.values())
        if ready and goal not in (None, self.car.floor) and not self._hazard(Hazard.OVERLOAD):
            assert goal is not None
            self.car.depart(self.now, goal, self._floor_s())

    def _floor_s(self) -> float | None:
        return _slowed(self._pace.floor_s, self.failures.get("car"))

    def _door_s(self, side: Side) -> float | None:
        return _slowed(self._pace.door_s, self.failures.get(f"{PREFIX[side]}door_operator"))

    # ---- its contacts

    def _lines(self) -> dict[str, bool]:
        """Return every input signal as the controller shows it."""
        lines = {h.value: self._hazard(h) for h in Hazard} | {"agv_mode": self.agv}
        for side, door in self.doors.items():
            lines |= self._door_lines(f"{PREFIX[side]}door", door)
        lines |= {"moving": not self.car.standing, "stopped": self.car.standing}
        lines |= {"up": self.car.course > 0, "down": self.car.course < 0}
        lines |= self._motion_lines() | self._service_lines() | self._floor_lines()
        if not self.agv:
            lines |= dict.fromkeys(self._only_in_agv, False)
        return lines

    def _door_lines(self, prefix: str, door: CarDoor) -> dict[str, bool]:
        single = getattr(self._wiring.inputs, prefix)
        proven = door.closed if single and single.proves == "closed" else door.opened
        return {prefix: proven, f"{prefix}_opened": door.opened, f"{prefix}_closed": door.closed}

    def _motion_lines(self) -> dict[str, bool]:
        code = self._wiring.inputs.motion
        if code is None:
            return {}
        course = {0: "stopped", 1: "up", -1: "down"}[self.car.course]
        states = (course,) if self.car.standing else (course, "moving")
        number = next(n for n, s in code.codes.items() if s in states)
        return codes.lines("motion", number, len(code.bits))

    def _service_lines(self) -> dict[str, bool]:
        code = self._wiring.inputs.service
        if code is None:
            return {}
        states = [h.value for h in Hazard if self._hazard(h)]
        states += ["agv_mode"] if self.agv else []
        states += ["normal", *(s for s in code.codes.values() if s not in ("agv_mode", "fault"))]
        numbers = {str(state): number for number, state in reversed(code.codes.items())}
        number = next(numbers[s] for s in states if s in numbers)
        return codes.lines("service", number, len(code.bits))

    def _floor_lines(self) -> dict[str, bool]:
        """Return the lines of the floor code. Between floors, a controller without a code for this
        position keeps the last code."""
        shown = self.car.shown
        try:
            self._code = self._wiring.floor_code.show(
                None if shown is None else self._levels[shown]
            )
        except ValueError:
            assert shown is None
        return self._code


def _sides(settings: DryContactLiftSettings, level: str) -> set[Side]:
    return {stop.side for stop in settings.stops().values() if stop.level == level}


def _buttons(settings: DryContactLiftSettings, doors: dict[Side, CarDoor]) -> list[str]:
    inputs = settings.inputs
    states = set(inputs.service.codes.values()) if inputs.service else set()
    hazards = [h.value for h in Hazard if getattr(inputs, h) or h in states]
    return [
        *hazards,
        *(f"hall_{level}" for level in settings.levels()),
        *(f"{PREFIX[side]}obstruction" for side in doors),
    ]


def _slowed(seconds: float, failure: FailureMode | None) -> float | None:
    if failure in ("off", "stuck"):
        return None
    return seconds * SLOWNESS if failure == "slow" else seconds


FAKE = Fake[DryContactLiftSettings](plant=lambda name, settings, wires: build(name, settings))

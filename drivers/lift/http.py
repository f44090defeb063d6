"""A lift behind a gateway that speaks HTTP and JSON, such as RMF's lift template or a maker's gateway.

If the network fails, only the gateway's own timers can end AGV mode and release the door. So the
request `ask`, which switches such a command on, also starts the command's timer
(`switches_off_after_s`). The driver repeats `ask` in every scan while the command is on. A call of the
car is one request, as when a person presses a button once.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Annotated, Protocol

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Hazard, LiftOutputs, LiftSample, Side
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers import DriverError, json_fields
from drivers.driver_type import DriverType
from drivers.hal import http
from drivers.hal.every import Every
from drivers.http_call import InsistentCalls, claim, described, send, timer_unseen
from drivers.json_fields import JsonFlag, JsonNumber
from drivers.lift import checks
from drivers.lift.http_api import HELD, LIFT_ID, PROFILE, Held, LiftApi, numbers, value_rows
from drivers.lift.json_state import decode
from drivers.lift.table import DEBOUNCE_S, HAZARD_DEBOUNCE_S
from drivers.lift.tables import floors, how_long
from drivers.unsafe import Unsafe, needlessly_accepted, unaccepted


class HttpLiftSettings(LiftSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A lift and its gateway's HTTP API."""

    profile: Annotated[
        Name | None, tells("the name of a file in drivers/profiles/ that holds the API.")
    ] = None
    api: Annotated[LiftApi | None, tells("the API, written here instead of a profile.")] = None
    lift_id: Annotated[
        Name | None,
        tells('the lift\'s id at the gateway. It replaces "{lift_id}" in the bodies of requests.'),
    ] = None

    def off_after(self) -> tuple[float, tuple[str, ...]] | None:
        """Return the time (s) of the shortest timer, and the path of this time in the YAML. Return None
        if there is no timer."""
        if any(PROFILE.problems(self.profile, self.api)):
            return None
        timers = (
            (command.switches_off_after_s, _path(self, "commands", name, "switches_off_after_s"))
            for name, command in api_of(self).commands.held().items()
        )
        return min(((s, path) for s, path in timers if s is not None), default=None)

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from checks.floors(self)
        yield from checks.alarm(self)
        wrong = list(PROFILE.problems(self.profile, self.api))
        yield from wrong
        if wrong:
            return
        found, levels = api_of(self), self.levels()
        commands, values = found.commands, found.state.floor.values
        if values:
            path = _path(self, "state", "floor", "values")
            yield from checks.named("value", path, values, levels)
        if not commands.call:
            path = _path(self, "commands", "calls")
            yield from checks.named("call", path, commands.calls, levels)
        yield from _rear_door(self, found)
        yield from _lift_id(self)
        if commands.cancel and self.limits.call_pulse_s is not None:
            text = (
                "after the pulse the daemon would withdraw the call by cancel, with the car on its"
                " way: delete call_pulse_s, because a call is one request"
            )
            yield ("limits", "call_pulse_s"), text
        told, asks = found.state.shows("agv_mode"), bool(commands.agv_mode_request)
        request = _path(self, "commands", "agv_mode_request")
        yield from checks.by_call(self, told, asks, request)
        yield from unaccepted(_unsafe(self), self.accept_unsafe)


def api_of(settings: HttpLiftSettings) -> LiftApi:
    """Return the API for this lift, from the YAML or the profile."""
    found = PROFILE.chosen(settings.profile, settings.api)
    return found if settings.lift_id is None else found.of_lift(settings.lift_id)


def _path(settings: HttpLiftSettings, *below: str) -> tuple[str, ...]:
    """Return the path in the YAML of a part of the API. If a profile gives the API, return the path of
    `profile`."""
    return ("api", *below) if settings.api else ("profile",)


def _rear_door(settings: HttpLiftSettings, found: LiftApi) -> Remarks:
    rear = any(stop.side is Side.REAR for stop in settings.stops().values())
    if rear and not found.state.rear_door:
        yield _path(settings, "state"), "no rear_door, but some floors have side: rear"
    if found.state.rear_door and not rear:
        yield _path(settings, "state", "rear_door"), "no floor has side: rear"
    if rear and found.commands.door_open and not found.commands.rear_door_open:
        text = "no rear_door_open, but some floors have side: rear"
        yield _path(settings, "commands"), text


def _lift_id(settings: HttpLiftSettings) -> Remarks:
    given = PROFILE.chosen(settings.profile, settings.api)
    used = any(LIFT_ID in (call.body or "") for call in given.requests().values())
    if used and settings.lift_id is None:
        yield (), f"needs 'lift_id', because requests of the API contain {LIFT_ID}"
    if settings.lift_id is not None and not used:
        yield ("lift_id",), f"no request contains {LIFT_ID}: delete lift_id"


def _unsafe(settings: HttpLiftSettings) -> Iterator[Unsafe]:
    for name, command in api_of(settings).commands.held().items():
        if command.switches_off_after_s is None:
            text = (
                f"when the network dies nothing switches {name} off: let ask set the gateway's"
                " own timer, and write the timer's time as switches_off_after_s"
            )
            yield name, _path(settings, "commands", name), text


def claims(settings: HttpLiftSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each command with its path in the YAML. No other device may send these commands, because it
    would disturb this lift."""
    if any(PROFILE.problems(settings.profile, settings.api)):
        return
    seen: set[str] = set()
    for below, call in api_of(settings).requests().items():
        if below[0] == "commands" and claim(call) not in seen:
            seen.add(claim(call))
            yield claim(call), (*_path(settings, *below), "path") if settings.api else ("profile",)


def warnings(settings: HttpLiftSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting to review before the lift goes
    into service."""
    found = api_of(settings)
    state, commands = found.state, found.commands
    told, fire = state.shows("agv_mode"), state.shows(Hazard.FIRE)
    asks, holds = bool(commands.agv_mode_request), bool(commands.door_open)
    yield from PROFILE.warnings(settings.profile, "ride each floor while somebody watches")
    yield from checks.missing(settings, _path(settings), told, asks, fire, holds)
    yield from checks.unseen(settings, state.shows)
    path = _path(settings, "state", "floor", "values")
    yield from checks.counts_down(settings, numbers(state.floor.values), path)
    yield from needlessly_accepted(_unsafe(settings), settings.accept_unsafe)
    if not state.motion:
        yield (
            _path(settings, "state"),
            "no field motion, so the car counts as standing whenever it is at a landing",
        )
    if not state.online and not state.age:
        text = (
            "neither a field online nor a field age: if the gateway loses the lift and repeats its"
            " last state, the daemon believes this state"
        )
        yield _path(settings, "state"), text
    if not commands.cancel:
        text = "no command cancel: the lift keeps a call until it has served it, even after a fault"
        yield _path(settings, "commands"), text
    for name, command in commands.held().items():
        path = _path(settings, "commands", name)
        off_s = command.switches_off_after_s
        if off_s is not None:
            text = f"pull the network plug while {name} is on: it must go off within {off_s:g} s"
            yield path, text
            if command.release and (text := timer_unseen(command.ask, off_s)):
                yield path, text
        if not command.shown:
            yield path, f"{name} is not shown in the state: switching off is not verified"


def notes(settings: HttpLiftSettings) -> Remarks:
    """Yield a note for each setting that is no mistake, but has side effects. The note has its path
    below the device."""
    return checks.notes(settings, api_of(settings).state.shows)


def debounce(settings: HttpLiftSettings) -> Mapping[str, float]:
    """Return the debounce times (s), which are the same as for contacts. A gateway needs them too,
    because its answer may show a state that has only half changed."""
    return {**DEBOUNCE_S, **dict.fromkeys(Hazard, HAZARD_DEBOUNCE_S)}


def describe(settings: HttpLiftSettings, bus: http.HttpSettings) -> Iterator[tuple[str, str]]:
    """Yield rows for `check` about the readings, the fields and the commands."""
    api, found = http.base(bus.api_base), api_of(settings)
    if found.state_path:
        yield "state", f"GET {api.url(found.state_path)} every {bus.scan_s:g} s"
    for name, call in found.state_parts.items():
        yield f"state {name}", f"{described(call, api)} every {bus.scan_s:g} s"
    for name, field in found.state.places().items():
        place = getattr(found.state, name)
        told = isinstance(place, JsonFlag | JsonNumber)
        yield name, json_fields.place_text(place) if told else field
    for path, call in found.commands.requests():
        yield " ".join(path), described(call, api)
    for name, command in found.commands.held().items():
        if off_s := command.switches_off_after_s:
            yield f"{name} ends", f"by itself, {off_s:g} s after the last request for it"


def tables(settings: HttpLiftSettings) -> Iterator[Table]:
    """Yield tables of the floors (lowest first), of each field's values, and of the commands'
    durations."""
    found, levels = api_of(settings), settings.levels()
    yield floors(settings)
    landings = ((json_fields.value_text(found.state.floor.value(at)), at) for at in levels)
    rows = [("floor", value, level) for value, level in landings] + [*value_rows(found.state)]
    yield Table(
        "values",
        ("field", "value", "means"),
        (*rows, ("each", "any other", "a fault, or out of service")),
    )
    held = ((name, how_long(settings, name)) for name in found.commands.held())
    cancelled = ", withdrawn by cancel" if found.commands.cancel else ""
    yield Table("outputs", ("output", "how long"), (*held, ("call", f"one request{cancelled}")))


class GatewayCalls(InsistentCalls, Protocol):
    """An HTTP bus that can read JSON with any method and body, not only with GET."""

    def get_json(
        self, path: str, method: http.Method = "GET", body: str | None = None
    ) -> dict[str, object]:
        """Get one JSON object. Raises HalError."""


def create(name: str, settings: HttpLiftSettings, bus: GatewayCalls) -> "HttpLift":
    """Make the lift's driver on its bus. The driver sends nothing before `open`."""
    return HttpLift(settings, bus)


class HttpLift:
    """The driver of one lift (`drivers.Driver[LiftSample, LiftOutputs]`).

    `_told` holds for each held command whether the driver last switched it on or off. If this is
    uncertain, the command is not in `_told`. `_called` is the landing of the last call that was not
    withdrawn. `_sure` is True if the gateway has answered the request for this call.
    """

    def __init__(self, settings: HttpLiftSettings, bus: GatewayCalls) -> None:
        self._api = api_of(settings)
        self._held = self._api.commands.held()
        self._levels, self._stale_s = settings.levels(), settings.stale_after()
        self._bus = bus
        self._told: dict[Held, bool] = {}
        self._called: str | None = None
        self._sure = False
        self._failed = ""
        self._claimed = self._touched = False

    def open(self) -> None:
        """Check that the gateway answers. Until the first success, also switch off every command that
        the state does not show as off, even if the state cannot be read.

        After that `open` only reads. A lost answer must not end a robot's ride.
        """
        on, every = [*self._held], Every()
        with every.one():
            answer = self._answer()
            on = [name for name in on if self._shown(name, answer) is not False]
        if not self._claimed:
            self._told = dict.fromkeys(self._held, False)
            with every.one():
                self._off(on)
        every.check()
        self._claimed = True

    def read(self) -> LiftSample:
        """Read and decode the state now. Raises DriverError."""
        (told, self._told), (sure, self._sure) = (self._told, {}), (self._sure, False)
        answer = self._answer()
        sample = decode(self._api.state, answer, self._levels, self._stale_s)
        self._told = {n: on for n, on in told.items() if self._shown(n, answer) in (None, on)}
        self._sure = sure
        return sample

    def write(self, outputs: LiftOutputs) -> None:
        """Set every command to its level in `outputs`. Commands that go off come first, each even if
        another one fails; then nothing goes on. Renew the commands that have a timer.

        A call that cannot be withdrawn keeps back only the next call, because the door must be held and
        AGV mode must last meanwhile.
        """
        wanted = {name: _wants(outputs, name) for name in self._held}
        idle = [name for name in wanted if not wanted[name] and self._told.get(name) is not False]
        offs: dict[str, Callable[[], None]]
        offs = {name: partial(self._switch, name, on=False) for name in idle}
        if self._called not in (None, outputs.call):
            offs["call"] = self._withdraw
        every, withdrawal, failed = Every(), Every(), self._failed
        self._failed = ""
        for name in sorted(offs, key=lambda name: name == failed):
            with (withdrawal if name == "call" else every).one():
                offs[name]()
            if every.failure or withdrawal.failure:  # the next attempt begins with another one
                self._failed = self._failed or name
        every.check()
        for name in (n for n in HELD if wanted.get(n)):
            if self._held[name].is_renewed() or not self._told.get(name):
                self._switch(name, on=True)
        withdrawal.check()
        if outputs.call is not None and not self._sure:
            self._call(outputs.call)

    def make_safe(self) -> None:
        """Switch every command off. Verify each command that the gateway's state shows."""
        self._off([*self._held])
        answer = self._answer() if any(c.shown for c in self._held.values()) else {}
        still = [name for name in self._held if self._shown(name, answer)]
        if still:
            raise DriverError(f"{' and '.join(still)} still on after being switched off")

    def close(self) -> None:
        """Switch every command off, if the driver ever sent a command. Does not raise."""
        if not self._touched:
            return
        try:
            self._off([*self._held])
        except DriverError:
            return  # do not raise: the gateway's timers will end the commands

    def _answer(self) -> Mapping[str, object]:
        """Return the state. If the state has several parts, the result has the answer for each part."""
        if self._api.state_path:
            return self._bus.get_json(self._api.state_path)
        parts = self._api.state_parts.items()
        return {name: self._bus.get_json(c.path, c.method, c.body) for name, c in parts}

    def _off(self, names: list[Held]) -> None:
        """Withdraw the call, and switch these commands off. Try each command, even if another command
        has failed."""
        failed: DriverError | None = None
        for step in (self._withdraw, *(lambda n=n: self._switch(n, on=False) for n in names)):
            try:
                step()
            except DriverError as error:
                failed = failed or error
                self._bus.insist()
        if failed:
            raise failed

    def _switch(self, name: Held, on: bool) -> None:
        self._told.pop(name, None)
        self._touched = True
        send(self._bus, self._held[name].ask if on else self._held[name].release, safe=not on)
        self._told[name] = on

    def _call(self, level: str) -> None:
        self._called, self._touched = level, True
        value = self._api.state.floor.value(level)
        send(self._bus, self._api.commands.calling(level, value))
        self._sure = True

    def _withdraw(self) -> None:
        self._sure = False
        send(self._bus, self._api.commands.cancel, safe=True)
        self._called = None

    def _shown(self, name: Held, answer: Mapping[str, object]) -> bool | None:
        return json_fields.certain_if(answer, self._held[name].shown)


def _wants(outputs: LiftOutputs, name: Held) -> bool:
    if name == "agv_mode_request":
        return outputs.agv_request
    return outputs.hold_door is (Side.FRONT if name == "door_open" else Side.REAR)


DRIVER = DriverType(
    settings=HttpLiftSettings,
    buses=("http",),
    create=create,
    debounce=debounce,
    describe=describe,
    commands=lambda settings: api_of(settings).commands.held(),
    tables=tables,
    claims=claims,
    warnings=warnings,
    notes=notes,
    unwired=lambda settings: HELD,
    fake="hal_fakes.http_lift",
)

"""A robot behind an HTTP interface. The interface belongs to the robot's fleet manager, or to the robot
itself. The YAML describes the interface, or a profile does (`rmf-demos`: the manager of RMF's
tutorial and demos).

A command's number (`$id`) never repeats, even after a restart of the daemon. So when a manager reports
a completed command by its number, this cannot be an older command. The core counts pauses, resumes and
the stop of a death from the beginning, so these get a number at random.
"""

import secrets
from collections.abc import Collection, Iterator, Mapping
from typing import Annotated, Final, Protocol, cast
from weakref import WeakKeyDictionary

import msgspec
from msgspec.structs import replace

from bridges.kinds.fleet.settings import FleetRobotSettings
from bridges.kinds.fleet.signals import Pose, RobotCommand, RobotOutputs, RobotSample
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError, json_fields
from drivers.driver_type import DriverType
from drivers.fleet.api import FleetApi, PathFields, body_with, path_with, values
from drivers.hal import HalError, http
from drivers.hal.http_json import RefusedCall
from drivers.http_call import Call, described
from drivers.profiles import Profile

PROFILE: Final = Profile("fleet_http", "api", FleetApi)
Answer = Mapping[str, object]


class HttpRobotSettings(FleetRobotSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One robot and the interface of its manager."""

    profile: Annotated[Name | None, tells("the interface of a known manager.")] = None
    api: Annotated[FleetApi | None, tells("the interface of another manager.")] = None

    def problems(self) -> Remarks:
        """Yield a problem for a missing or unknown interface."""
        yield from super().problems()
        yield from PROFILE.problems(self.profile, self.api)

    def lacks(self, control: str) -> str:
        """Return a text that names the calls and fields that the interface lacks for this `control` and
        for the robot's `on_death`. Return "" if nothing is missing."""
        api, dies = self.interface(), self.on_death
        if dies != "finish" and getattr(api, dies) is None:
            return f"on_death: {dies} needs the call '{dies}' in the interface"
        return api.lacks(control)

    def known_actions(self) -> Collection[str]:
        """Return the actions of the interface."""
        return self.interface().actions

    def interface(self) -> FleetApi:
        """Return the interface."""
        return PROFILE.chosen(self.profile, self.api)


class FleetCalls(Protocol):
    """A driver's calls on an HTTP bus."""

    def get_json(self, path: str) -> dict[str, object]:
        """Get one JSON object. Raises HalError."""

    def send(
        self, path: str, method: http.Method = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        """Send one request, without retry. Raises HalError."""

    def ask(
        self, path: str, method: http.Method = "POST", body: str | None = None, safe: bool = False
    ) -> dict[str, object]:
        """Send one request, without retry, and return its answer. Raises HalError."""


class _AllAnswer:
    """The last answer that covers all robots of one bus. Several robots share it. When a robot asks for
    its part a second time, the answer is requested anew."""

    def __init__(self) -> None:
        self._robots: dict[str, Answer] = {}
        self._asked: set[str] | None = None

    def of(self, robot: str, bus: FleetCalls, path: str, api: FleetApi) -> Answer:
        """Return the part of the answer that is about this robot. Raises DriverError."""
        if self._asked is None or robot in self._asked:
            self._asked = None
            self._robots = dict(_listed(bus.get_json(path), api))
            self._asked = set()
        self._asked.add(robot)
        if robot not in self._robots:
            known = ", ".join(map(json_fields.clean, list(self._robots)[:5])) or "none"
            raise DriverError(f"the manager has no robot '{robot}'; it has {known}")
        return self._robots[robot]


_all: WeakKeyDictionary[FleetCalls, dict[str, _AllAnswer]] = WeakKeyDictionary()


def _listed(answer: Answer, api: FleetApi) -> Iterator[tuple[str, Answer]]:
    assert api.robots
    found = json_fields.needed(answer, api.robots.list)
    if not isinstance(found, list):
        raise json_fields.wrong(api.robots.list, found, "a list of robots")
    for item in found:
        if isinstance(item, dict):
            yield json_fields.name(item, api.robots.name), item


class HttpRobot:
    """The driver of one robot (`drivers.Driver`)."""

    def __init__(self, name: str, settings: HttpRobotSettings, bus: FleetCalls) -> None:
        self._robot = settings.known_as or name
        self._settings = settings
        self._api = settings.interface()
        self._bus = bus
        self._sent, self._running = (0, 0), 0
        self._numbered: tuple[tuple[str, int, int], int] = ("", 0, 0), 0
        self._refused = ""
        self._unanswered = False

    def open(self) -> None:
        """Do nothing, because a restart must not stop a robot."""

    def read(self) -> RobotSample:
        """Read the robot's state. Raises DriverError for an answer that makes no sense, or that is
        about another robot."""
        answers = dict[str, Answer]()
        fields = self._api.fields

        def answer(field: str) -> Answer:
            path = self._api.paths.get(fields.part_of(field), self._api.state_path)
            if path not in answers:
                answers[path] = self._answer(path)
            return answers[path]

        def number(field: str) -> float:
            found = json_fields.number(answer(field), getattr(fields, field), 1.0)
            if found is None:
                raise DriverError(
                    f"the answer has no {field}: '{getattr(fields, field)}' is missing"
                )
            return found

        def flag(field: str) -> bool | None:
            place = getattr(fields, field)
            return json_fields.flag_if(answer(field) if place else {}, place)

        if fields.name and (said := json_fields.name(answer("name"), fields.name)) != self._robot:
            raise DriverError(
                f"the manager answers about robot '{said}', but was asked about '{self._robot}'"
            )
        level = json_fields.name(answer("map"), fields.map)
        at = Pose(level, number("x"), number("y"), number("yaw"))
        percent = self._api.units.battery == "percent"
        completed = fields.completed and json_fields.name(answer("completed"), fields.completed)
        return RobotSample(
            at=self._settings.level_of(self._api.units.read(at)),
            battery=number("battery") / (100.0 if percent else 1.0),
            moving=flag("moving"),
            charging=flag("charging"),
            completed=completed,
            fault=json_fields.text(answer("fault"), fields.fault) if fields.fault else "",
            taken_out="" if flag("ready") in (None, True) else "its manager calls it not ready",
            said_at=number("time") if fields.time else None,
            path=self._path(answer("path"), level) if fields.path else None,
            paused=flag("paused"),
            refused=self._refused,
            unanswered=self._unanswered,
            taken=(0, 0) if self._refused else self._sent,
        )

    def _path(self, answer: Answer, level: str) -> tuple[Pose, ...]:
        """Return the places of the robot's path. `level` is the robot's map, which a place without a
        map is on."""
        place = self._api.fields.path
        assert place is not None
        items = json_fields.needed(answer, place.list)
        if not isinstance(items or [], list):
            raise json_fields.wrong(place.list, items, "a list of places")
        return tuple(self._place(item, place, level) for item in cast(list[object], items or []))

    def _place(self, item: object, place: PathFields, level: str) -> Pose:
        if not isinstance(item, dict):
            raise json_fields.wrong(place.list, item, "a place")
        x, y = (json_fields.number(item, field, 1.0) for field in (place.x, place.y))
        if x is None or y is None:
            raise DriverError(f"an item of '{place.list}' has no '{place.x}' or no '{place.y}'")
        on = json_fields.name(item, place.map) if place.map else level
        return self._settings.level_of(self._api.units.read(Pose(on, x, y)))

    def _answer(self, path: str) -> Answer:
        if self._api.robots and path == self._api.state_path:
            shared = _all.setdefault(self._bus, {}).setdefault(path, _AllAnswer())
            return shared.of(self._robot, self._bus, path, self._api)
        return self._bus.get_json(path_with(path, {"robot": self._robot}))

    def write(self, outputs: RobotOutputs) -> None:
        """Send the command once for each attempt.

        If the answer to an action is lost, the robot may have begun the action. So count the action as
        sent.
        """
        command = outputs.command
        if command is None or self._sent == (command.id, command.attempt):
            return
        call = self._call(command)
        if call is None:
            what = f"action '{command.activity}'" if command.doing == "act" else command.doing
            self._done(command, f"there is no call for the {what}")
            return
        try:
            refused = self._send(call, command)
        except RefusedCall as error:
            refused = f"{command.doing} is refused: {error}"
        except HalError:
            if command.doing == "act":
                self._done(command, unanswered=True)
            raise
        self._done(command, refused)

    def _done(self, command: RobotCommand, refused: str = "", unanswered: bool = False) -> None:
        self._sent = (command.id, command.attempt)
        if command.doing not in ("pause", "resume"):
            self._running = command.of or command.id
        self._refused, self._unanswered = refused, unanswered

    def _call(self, command: RobotCommand) -> Call | None:
        match command.doing:
            case "act":
                return self._api.actions.get(command.activity)
            case "dock":
                return self._api.dock or self._api.navigate
            case "localize":
                return self._api.localize or _NOTHING
            case "stop" | "pause" | "resume" as doing:
                return cast(Call | None, getattr(self._api, doing))
        return self._api.navigate

    def _send(self, call: Call, command: RobotCommand) -> str:
        """Send a call. Return the manager's reason if it refuses the call, or ""."""
        if call is _NOTHING:
            return ""
        if command.doing in ("pause", "resume") or not command.id:
            command = replace(command, id=self._number_of(command))
        given = values(self._settings.theirs(command), self._robot, self._api.units)
        path = path_with(call.path, given)
        body = None if call.body is None else body_with(call.body, given)
        safe = command.doing in ("stop", "pause")
        if self._api.accepted is None:
            self._bus.send(path, call.method, body, safe=safe)
            return ""
        answer = self._bus.ask(path, call.method, body, safe=safe)
        if json_fields.flag(answer, self._api.accepted):
            return ""
        why = json_fields.clean(str(answer.get("msg") or ""))
        return f"{command.doing} is refused" + (f": {why}" if why else "")

    def _number_of(self, command: RobotCommand) -> int:
        """Return a number at random for this attempt. A call that is sent again in the same attempt has
        the same number."""
        attempt = command.doing, command.id, command.attempt
        if self._numbered[0] != attempt:
            self._numbered = attempt, 1 + secrets.randbelow(2**31 - 1)
        return self._numbered[1]

    def make_safe(self) -> None:
        """Stop or pause the robot, as `on_death` says. With `on_death: finish` do nothing, so that the
        robot drives to its last goal. Raises DriverError if the manager refuses."""
        dies = self._settings.on_death
        if dies == "finish":
            return
        command = RobotCommand(0, dies, of=self._running)
        if (call := self._call(command)) and (refused := self._send(call, command)):
            raise DriverError(refused)

    def close(self) -> None:
        """Do nothing, because the driver holds no resource."""


_NOTHING: Final = Call(path="/")
"""A stand-in for the call of a command that needs no call, because the robot carries it out by
itself."""


def describe(settings: HttpRobotSettings, bus_settings: http.HttpSettings) -> list[tuple[str, str]]:
    """Return the rows that `check` prints instead of a wiring table. Each row is a subject and its
    meaning."""
    api, base = settings.interface(), http.base(bus_settings.api_base)
    whose = "all robots" if api.robots else "the robot"
    rows = [("interface", base.url(""))]
    rows += [("state", f"GET {api.state_path} every {bus_settings.scan_s:g} s: {whose}")]
    rows += [(part, f"GET {path}") for part, path in api.paths.items()]
    rows += [(" ".join(where), described(call, base)) for where, call in api.calls()]
    fields = msgspec.structs.asdict(api.fields)
    for name, place in fields.items():
        if place is not None:
            place = getattr(place, "list", place)
            text = place if isinstance(place, str) else json_fields.place_text(place)
            rows.append((name, text))
    rows.append(("on death", settings.on_death))
    return rows


def warnings(settings: HttpRobotSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    yield from PROFILE.warnings(settings.profile, "drive one robot through one patrol first")
    fields = settings.interface().fields
    key = ("profile",) if settings.profile else ("api", "fields")
    if fields.time is None and settings.api:
        yield (
            key,
            "without the field 'time' the daemon cannot notice a manager that repeats the last place"
            " of a lost robot",
        )


DRIVER = DriverType(
    settings=HttpRobotSettings,
    buses=("http",),
    create=HttpRobot,
    describe=describe,
    warnings=warnings,
    fake="hal_fakes.http_fleet",
)

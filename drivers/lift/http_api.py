"""The HTTP API of a lift's gateway: the requests for the lift's state, and the commands.

`profile: NAME` takes such an API from drivers/profiles/. In a body, the text "{lift_id}", with its
quotes, stands for the device's `lift_id`. The text "{level}" stands for the value of the called
landing.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Annotated, Final, Literal

import msgspec

from bridges.kinds.shared.fields import Name, Timeout, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import json_fields
from drivers.hal import http
from drivers.http_call import Call
from drivers.json_fields import JsonFlag, Value
from drivers.lift.json_state import JsonLiftState
from drivers.profiles import Profile

LEVEL: Final = '"{level}"'
LIFT_ID: Final = '"{lift_id}"'
Part = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[a-z][a-z0-9_]*$(?!\n)", extra={"pattern": "a name in small letters (car)"}
    ),
]
Held = Literal["agv_mode_request", "door_open", "rear_door_open"]
HELD: Final[tuple[Held, ...]] = ("agv_mode_request", "door_open", "rear_door_open")
"""The commands that stay on until the driver switches them off. The driver switches them on in this
order."""


class HeldCommand(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A command that the driver switches on and off."""

    ask: Annotated[Call, tells("the request that switches the command on.")]
    release: Annotated[
        Call | None,
        tells("""the request that switches the command off. Give no `release` if the gateway keeps
        the command only for a moment. The driver then repeats `ask` in each scan while the command
        is on."""),
    ] = None
    shown: Annotated[
        JsonFlag | None,
        tells("the command is on. Without this field nothing proves that the command is off."),
    ] = None
    switches_off_after_s: Annotated[
        Timeout | None,
        tells("""the time of the gateway's own timer. The timer ends the command this long after the
        last `ask`. The driver sends `ask` in each scan."""),
    ] = None

    def is_renewed(self) -> bool:
        """Does the driver send `ask` in every scan while the command is on?"""
        return self.release is None or self.switches_off_after_s is not None

    def problems(self) -> Remarks:
        """Yield a problem for a `release` that equals `ask`."""
        if self.ask == self.release:
            yield ("release",), "is the same request as ask"


class LiftCommands(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The commands to the gateway."""

    agv_mode_request: Annotated[
        HeldCommand | None, tells("requests AGV mode while a robot holds the lift.")
    ] = None
    door_open: Annotated[
        HeldCommand | None, tells("holds the door open at the landing where the car stands.")
    ] = None
    rear_door_open: Annotated[
        HeldCommand | None, tells("holds the rear door open at the landing where the car stands.")
    ] = None
    call: Annotated[
        Call | None, tells('calls the car. The landing\'s value replaces "{level}" in the body.')
    ] = None
    calls: Annotated[
        dict[Name, Call],
        tells("landing -> the request that calls the car there. It replaces `call`."),
    ] = {}
    cancel: Annotated[
        Call | None,
        tells("withdraws the call. Without `cancel` a call stays until the lift has served it."),
    ] = None

    def held(self) -> dict[Held, HeldCommand]:
        """Return each held command that the YAML gives. The keys are the commands' names."""
        given = {name: getattr(self, name) for name in HELD}
        return {name: command for name, command in given.items() if command is not None}

    def calling(self, level: str, value: Value) -> Call:
        """Return the request that calls the car to this landing. `value` is the landing's value in the
        API."""
        if self.call is None:
            return self.calls[level]
        return _filled(self.call, LEVEL, value)

    def requests(self) -> Iterator[tuple[tuple[str, ...], Call]]:
        """Yield each request with its path. The path begins below this section of the YAML."""
        for name, command in self.held().items():
            yield (name, "ask"), command.ask
            if command.release:
                yield (name, "release"), command.release
        yield from ((("calls", level), call) for level, call in self.calls.items())
        yield from (((n,), c) for n, c in (("call", self.call), ("cancel", self.cancel)) if c)

    def problems(self) -> Remarks:
        """Yield a problem if the YAML gives both `call` and `calls`, and if the body of `call` lacks
        the landing. Yield a problem for a request that occurs twice, and for a flag that shows two
        commands."""
        if self.call and self.calls:
            yield ("calls",), "calls and call are alternatives: delete one of the two"
        if self.call and LEVEL not in (self.call.body or ""):
            yield (
                ("call",),
                f"does not contain the landing: write {LEVEL} into its body, or give calls",
            )
        seen: list[tuple[str, Call]] = []
        for path, call in self.requests():
            same = [other for other, before in seen if before == call]
            if same and path[-1] != "release":
                yield path, f"{'.'.join(path)} is the same request as {same[0]}"
            seen.append((".".join(path), call))
        shown = {name: command.shown for name, command in self.held().items() if command.shown}
        for name, flag in shown.items():
            other = next(before for before, same in shown.items() if same == flag)
            if other != name:
                text = (
                    f"shows {other} too, so it does not prove that {name} is off: use another field"
                )
                yield (name, "shown"), text


class LiftApi(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The gateway's API. Every path is relative to the bus's `api_base`."""

    state_path: Annotated[
        http.Path | None, tells("the path that GET reads the whole state from.")
    ] = None
    state_parts: Annotated[
        dict[Part, Call],
        msgspec.Meta(max_length=8),
        tells("""name -> a request that reads a part of the state. The fields of its answer begin
        with this name (`car.floor`). Give either `state_parts` or `state_path`."""),
    ] = {}
    state: Annotated[JsonLiftState, tells("the fields of the answers.")]
    commands: Annotated[LiftCommands, tells("the commands to the gateway.")]

    def requests(self) -> dict[tuple[str, ...], Call]:
        """Return all requests except a GET of `state_path`. The keys are their paths, which begin below
        this section of the YAML."""
        parts = {("state_parts", name): call for name, call in self.state_parts.items()}
        return parts | {("commands", *path): call for path, call in self.commands.requests()}

    def of_lift(self, lift_id: str) -> "LiftApi":
        """Return this API for one lift of the gateway."""

        def filled(part: object) -> object:
            if isinstance(part, Call):
                return _filled(part, LIFT_ID, lift_id)
            if isinstance(part, dict):
                return {key: filled(value) for key, value in part.items()}
            if isinstance(part, HeldCommand | LiftCommands | LiftApi):
                fields = {name: filled(getattr(part, name)) for name in part.__struct_fields__}
                return msgspec.structs.replace(part, **fields)
            return part

        found = filled(self)
        assert isinstance(found, LiftApi)
        return found

    def problems(self) -> Remarks:
        """Yield a problem if no request, or two sorts of requests, would read the state. Yield a
        problem for a field that belongs to no part of the state."""
        if bool(self.state_path) == bool(self.state_parts):
            yield ("state_path",), "give either state_path or state_parts"
        elif self.state_parts:
            for name, field in self.state.places().items():
                if field.partition(".")[0] not in self.state_parts:
                    known = ", ".join(self.state_parts)
                    text = f"{field} begins with none of state_parts, which are {known}"
                    yield ("state", name, "field"), text


PROFILE: Final = Profile("lift_http", "api", LiftApi)


def _filled(call: Call, mark: str, value: Value) -> Call:
    body = call.body and call.body.replace(mark, json.dumps(value))
    return msgspec.structs.replace(call, body=body)


def numbers(values: Mapping[str, Value]) -> dict[int, str]:
    """Return the landing for each value that is a whole number. Leave out landings with other
    values."""
    return {
        value: level
        for level, value in values.items()
        if isinstance(value, int) and not isinstance(value, bool)
    }


def value_rows(state: JsonLiftState) -> Iterator[tuple[str, str, str]]:
    """Yield (part, value, meaning) of each listed value."""
    for name in ("door", "rear_door", "motion", "service"):
        if place := getattr(state, name):
            for meaning, values in place.states().items():
                yield name, ", ".join(map(json_fields.value_text, values)), meaning

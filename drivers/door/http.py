"""A door behind a controller that speaks HTTP and JSON. An example is a Shelly, which is a relay with
inputs.

The controller's answer to a GET of `state_path` shows the door's contacts. The relay holds the door
open. The command `hold` switches the relay on, and the command `release` switches it off.

If the network fails, only the relay's own timer can release the door. So `hold` also starts this timer
(`switches_off_after_s`). While RMF holds the door, the driver sends `hold` in every scan, so that the
timer does not run out.
"""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Annotated, Final

import msgspec

from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.kinds.shared.fields import Timeout, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError, json_fields
from drivers.door.closing import CLOSING
from drivers.driver_type import DriverType
from drivers.hal import http
from drivers.hal.every import Every
from drivers.http_call import Call, InsistentCalls, claim, described, send, timer_unseen
from drivers.json_fields import JsonFlag
from drivers.unsafe import Unsafe, needlessly_accepted, unaccepted

HOLD: Final = "hold_open"


class DoorInputFields(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of the answer. With `feedback: estimated` the fields `opened` and `closed` may be
    missing."""

    opened: Annotated[JsonFlag | None, tells("the door is fully open.")] = None
    closed: Annotated[JsonFlag | None, tells("the door is closed.")] = None
    obstruction: Annotated[
        JsonFlag | None,
        tells("somebody is in the doorway. A held door stays held until the doorway is clear."),
    ] = None
    fire: Annotated[JsonFlag | None, tells("the fire alarm; `on_fire` sets its effect.")] = None


class HttpDoorSettings(DoorSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A door and its controller. Every path is relative to the bus's `api_base`."""

    state_path: Annotated[http.Path, tells("the path that GET reads the inputs from.")]
    inputs: Annotated[DoorInputFields, tells("the fields of that answer.")] = DoorInputFields()
    hold: Annotated[Call, tells("switches on the relay that holds the door open.")]
    release: Annotated[
        Call, tells("switches this relay off, so that the door operator closes the door.")
    ]
    held: Annotated[
        JsonFlag | None,
        tells("the relay is on. Without this field nothing proves that the relay is off."),
    ] = None
    switches_off_after_s: Annotated[
        Timeout | None,
        tells("""the time of the relay's own timer, which `hold` sets (`…&toggle_after=10`). The
        timer switches the relay off this long after the last `hold`."""),
    ] = None

    def off_after(self) -> tuple[float, tuple[str, ...]] | None:
        """Return the time (s) of the relay's timer, and the path of this time in the YAML. Return None
        without a timer."""
        path = ("switches_off_after_s",)
        return None if self.switches_off_after_s is None else (self.switches_off_after_s, path)

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        missing = [
            signal for signal in ("opened", "closed") if getattr(self.inputs, signal) is None
        ]
        if self.feedback == "sensors":
            for signal in missing:
                text = f"needs '{signal}'; if the door has no such input, write feedback: estimated"
                yield ("inputs",), text
        elif not missing:
            yield ("feedback",), "opened and closed are both given: delete feedback"
        if bool(self.inputs.fire) != bool(self.on_fire):
            yield (
                ("inputs",),
                "a fire input needs on_fire, and on_fire needs a fire input: give or delete both",
            )
        for signal in self.inputs.__struct_fields__:
            place = getattr(self.inputs, signal)
            if place and self.held and place.field == self.held.field:
                text = "is the field of held, which shows the relay, and not the door"
                yield ("inputs", signal, "field"), text
        if self.hold == self.release:
            yield ("release",), "is the same command as hold"
        yield from unaccepted(_unsafe(self), self.accept_unsafe)


def _unsafe(settings: HttpDoorSettings) -> Iterator[Unsafe]:
    if settings.switches_off_after_s is None:
        text = (
            "when the network dies nothing releases the door: let hold set the relay's own"
            " timer, and write the timer's time as switches_off_after_s"
        )
        yield HOLD, ("hold",), text


def claims(settings: HttpDoorSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each command with its path in the YAML. No other door may send these commands, because it
    would then hold or release this door."""
    yield claim(settings.hold), ("hold", "path")
    if settings.release != settings.hold:
        yield claim(settings.release), ("release", "path")


def describe(settings: HttpDoorSettings, bus: http.HttpSettings) -> Iterator[tuple[str, str]]:
    """Yield rows for `check` about the state that the driver reads, and about the commands."""
    api = http.base(bus.api_base)
    yield "state", f"GET {api.url(settings.state_path)} every {bus.scan_s:g} s"
    for signal in settings.inputs.__struct_fields__:
        if place := getattr(settings.inputs, signal):
            yield signal, json_fields.place_text(place)
    if settings.held:
        yield "held", json_fields.place_text(settings.held)
    yield "hold", described(settings.hold, api) + _renewed(settings, bus)
    yield "release", described(settings.release, api)
    yield CLOSING


def _renewed(settings: HttpDoorSettings, bus: http.HttpSettings) -> str:
    if settings.switches_off_after_s is None:
        return ""
    after = f"the relay goes off by itself after {settings.switches_off_after_s:g} s"
    return f", again every {bus.scan_s:g} s while the door is held: {after}"


def warnings(settings: HttpDoorSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting to review before the door goes
    into service."""
    if settings.switches_off_after_s is not None:
        text = (
            "pull the network plug while RMF holds the door: the door must be released in this time"
        )
        yield ("switches_off_after_s",), text
        if text := timer_unseen(settings.hold, settings.switches_off_after_s):
            yield ("hold", "path"), text
    yield from needlessly_accepted(_unsafe(settings), settings.accept_unsafe)
    if settings.held is None:
        yield (), "without the field 'held' the driver cannot verify that the door was released"
    if settings.feedback == "estimated":
        yield (
            ("feedback",),
            "RMF gets OPEN and CLOSED after fixed times, whatever the door really does",
        )


def create(name: str, settings: HttpDoorSettings, bus: InsistentCalls) -> "HttpDoor":
    """Make the door's driver on its bus. The driver sends nothing before `open`."""
    return HttpDoor(settings, bus)


class HttpDoor:
    """The driver of one door (`drivers.Driver`). `_told` is True if the driver's last command was to
    hold, and False if it was to release. `_told` is None if the relay may not have followed the
    command."""

    def __init__(self, settings: HttpDoorSettings, bus: InsistentCalls) -> None:
        self._settings = settings
        self._bus = bus
        self._renews = settings.switches_off_after_s is not None
        self._told: bool | None = None
        self._claimed = False
        self._touched = False

    def open(self) -> None:
        """Check that the controller answers. Until the first success, release the door too, even if its
        state cannot be read.

        After that `open` only reads, and sends no release. A lost answer must not release a door that
        RMF still holds.
        """
        held, every = None, Every()
        with every.one():
            held = self._held(self._bus.get_json(self._settings.state_path))
        if not self._claimed and held is not False:
            with every.one():
                self._send(on=False)
        every.check()
        self._claimed = True

    def read(self) -> DoorSample:
        """Read every input now. Raises DriverError."""
        told, self._told = self._told, None
        answer = self._bus.get_json(self._settings.state_path)
        sample = decode(self._settings, answer)
        self._told = told if self._held(answer) in (None, told) else None
        return sample

    def write(self, outputs: DoorOutputs) -> None:
        """Hold or release the door. If the relay has a timer, send the hold in every scan."""
        if outputs.hold_open != self._told or (outputs.hold_open and self._renews):
            self._send(outputs.hold_open)

    def make_safe(self) -> None:
        """Release the door. Verify the release if the relay's state can be read."""
        self._send(on=False)
        if self._settings.held and self._held(self._bus.get_json(self._settings.state_path)):
            raise DriverError("the relay is still on after it was switched off")

    def close(self) -> None:
        """Release the door if the driver ever held it. Does not raise."""
        if not self._touched:
            return
        self._bus.insist()
        try:
            self._send(on=False)
        except DriverError:
            return  # do not raise: the relay's own timer will switch the relay off

    def _send(self, on: bool) -> None:
        self._told, self._touched = None, True
        send(self._bus, self._settings.hold if on else self._settings.release, safe=not on)
        self._told = on

    def _held(self, answer: Mapping[str, object]) -> bool | None:
        return json_fields.certain_if(answer, self._settings.held)


def decode(settings: HttpDoorSettings, answer: Mapping[str, object]) -> DoorSample:
    """Decode the answer. Raises DriverError with the name of an invalid field."""
    found, said = settings.inputs, partial(json_fields.certain_if, answer)
    return DoorSample(
        said(found.opened), said(found.closed), said(found.obstruction), said(found.fire)
    )


DRIVER = DriverType(
    settings=HttpDoorSettings,
    buses=("http",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=warnings,
    unwired=lambda settings: (HOLD,),
    fake="hal_fakes.http_door",
)

"""One point of the YAML's `points`. A point is a state that a device publishes, or a relay that a
device switches."""

from typing import Annotated

import msgspec

from bridges.kinds.shared.fields import Name, Timeout, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError, json_fields
from drivers.hal.http_json import strict_json
from drivers.hal.mqtt.makes import MAKES, Profile
from drivers.hal.mqtt.topics import Age, Answer, Ask, Availability, RelayCommand, Topic
from drivers.hal.points import HalError
from drivers.json_fields import Field, Value

WHOLE = "payload"
"""The word that messages use in place of a field's name if the whole payload is the value."""


class MqttPoint(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """A contact or relay behind a broker. A profile gives the topics, payloads and fields of a make."""

    profile: Annotated[
        Profile | None,
        tells("the make. Without `profile`, write the keys from `topic` to `command`."),
    ] = None
    device: Annotated[
        Topic | None,
        tells(
            "with a profile, the device's name on MQTT. The device's topics begin with this name."
        ),
    ] = None
    part: Annotated[
        Name | None, tells("with a profile, the relay or input: `switch:0`, `POWER1`, `contact`.")
    ] = None
    topic: Annotated[Topic | None, tells("where the device publishes the state.")] = None
    field: Annotated[
        Field | None,
        tells("the field of the JSON payload. Without `field` the whole payload is the value."),
    ] = None
    when: Annotated[
        list[Value],
        tells("the values that mean on. Without `when` the value must be true or false."),
    ] = []
    when_not: Annotated[
        list[Value], tells("with `when`, the values that mean off. Any other value is a fault.")
    ] = []
    stale_after_s: Annotated[
        Age | None,
        tells("""a state that is older counts as unknown. Write a longer time than the device's own
        period, or than the device needs to answer `ask`."""),
    ] = None
    ask: Annotated[
        Ask | None, tells("a message, sent in every scan, that makes the device publish its state.")
    ] = None
    availability: Annotated[
        Availability | None,
        tells("the notice that the device has lost its connection to the broker."),
    ] = None
    command: Annotated[RelayCommand | None, tells("switches the relay.")] = None
    answers_within_s: Annotated[
        Answer, tells("how soon after a command the device must publish the new state.")
    ] = 2.0
    switches_off_after_s: Annotated[
        Timeout | None,
        tells("""the time of the relay's own timer. The timer switches the relay off this long after
        the last "on" message. The driver sends the "on" message in every scan while the relay is
        on."""),
    ] = None
    without_timer: Annotated[
        Name | None, tells("why this relay may stay on when the network or the broker fails.")
    ] = None

    def whole(self) -> "MqttPoint":
        """Return the point, with the keys of its profile added. A key in the YAML replaces the
        profile's key. Raises ValueError."""
        if self.profile is None:
            return self
        keys = MAKES[self.profile](self.device or "", self.part or "", self.switches_off_after_s)
        return msgspec.convert({**keys, **msgspec.to_builtins(self)}, MqttPoint)

    def problems(self) -> Remarks:
        """Yield problems that involve more than one key."""
        if self.profile and not (self.device and self.part):
            yield (
                ("profile",),
                "needs device (its name on MQTT) and part (the relay or input of the device)",
            )
            return
        if not self.profile and (self.device or self.part):
            yield (
                ("device" if self.device else "part",),
                "is only for points with a profile: add profile, or delete this key",
            )
            return
        try:
            whole = self.whole()
        except ValueError as error:
            yield ("part",), str(error)
            return
        yield from _state_problems(whole)
        yield from _relay_problems(whole)

    def asserted(self, payload: bytes) -> bool:
        """Decode the state. Raises HalError for a payload that means neither on nor off."""
        try:
            value = self._value(payload)
            if not self.when and isinstance(value, bool):
                return value
            for values, means in ((self.when, True), (self.when_not, False)):
                if any(json_fields.same(value, one) for one in values):
                    return means
            wanted = " or ".join(map(repr, [*self.when, *self.when_not])) or "true or false"
            raise json_fields.wrong(self.field or WHOLE, value, wanted)
        except DriverError as error:
            raise HalError(f"{self.topic}: {error}") from None

    def _value(self, payload: bytes) -> object:
        if self.field is None:
            return decoded(payload)
        try:
            value = strict_json(payload.decode(errors="replace"))
        except ValueError as error:
            raise DriverError(f"is no JSON: {error}") from None
        if not isinstance(value, dict):
            raise json_fields.wrong(WHOLE, value, "a JSON object")
        return json_fields.needed(value, self.field)


def decoded(payload: bytes) -> object:
    """Decode JSON. Return any other payload as text."""
    text = payload.decode(errors="replace")
    try:
        return strict_json(text)
    except ValueError:
        return text


def _state_problems(point: MqttPoint) -> Remarks:
    if point.topic is None and point.command is None:
        yield (), "needs topic (for a state), command (for a relay), or a profile"
    if point.topic and point.stale_after_s is None:
        yield (), "needs stale_after_s: the age from which this state is unknown"
    if bool(point.when) != bool(point.when_not):
        yield (
            ("when",),
            "needs when_not, and when_not needs when: a value in neither list is a fault",
        )
    for value in point.when:
        if any(json_fields.same(value, other) for other in point.when_not):
            yield ("when_not",), f"{value} is in when too"
    if point.field is None:
        yield from _quoted("when", point.when)
        yield from _quoted("when_not", point.when_not)
    if point.topic is None and (point.field or point.when or point.ask or point.availability):
        yield (), "field, when, ask and availability belong to a state: add topic"


def _quoted(key: str, values: list[Value]) -> Remarks:
    """Yield a problem for each text that no payload can be, because JSON decodes this payload."""
    for value in values:
        if isinstance(value, str) and not isinstance(decoded(value.encode()), str):
            text = f"write {value} without quotes: this payload is a number, true, false or null"
            yield (key,), text


def _relay_problems(point: MqttPoint) -> Remarks:
    if point.command is None:
        for key in ("switches_off_after_s", "without_timer"):
            if getattr(point, key) is not None:
                yield (key,), "is only for a relay: add command, or delete this key"
        return
    if point.switches_off_after_s is None and point.without_timer is None:
        text = (
            "unsafe: nothing switches this relay off when the network or the broker fails. If the"
            " relay has a timer of its own, write the timer's time as switches_off_after_s. Otherwise"
            " write without_timer: <why it is safe here>"
        )
        yield (), text
    if point.switches_off_after_s is not None and point.without_timer is not None:
        yield ("without_timer",), "the relay has a timer of its own: delete without_timer"

"""Topics, messages and commands of MQTT, as the YAML gives them."""

from typing import Annotated, Final, Literal

import msgspec

from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks

PAYLOAD_MAX: Final = 256 * 1024
"""The maximum length (bytes) of a payload. The state of a VDA 5050 vehicle may be that long."""
TOPICS_MAX: Final = 512
"""The maximum number of topics that one bus listens to."""

Topic = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[^\x00-\x20\x7f-\x9f#+$]([^\x00-\x1f\x7f-\x9f#+]*[^\x00-\x20\x7f-\x9f#+])?$(?!\n)",
        max_length=256,
        extra={"pattern": "one whole topic, without the wildcards # and + (door-1/status/input:0)"},
    ),
]
"""The name of one topic. Wildcards are refused. With a wildcard the messages of an unknown device could
pass for those of a known device."""
Payload = Annotated[str, msgspec.Meta(max_length=1024)]
Age = Annotated[float, msgspec.Meta(ge=0.1, le=86400, extra={"unit": "s"})]
Answer = Annotated[float, msgspec.Meta(ge=0.1, le=60, extra={"unit": "s"})]
Qos = Literal[0, 1]
"""The delivery of a message: at most once (0), or at least once (1). "Exactly once" (2) would add
nothing, because the driver itself repeats its "on" and "off" messages anyway."""


class Ask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A message that makes a device publish its state."""

    topic: Annotated[Topic, tells("where the device listens.")]
    payload: Annotated[Payload, tells("the message.")] = ""


class Availability(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A notice that a device has lost its connection. The notice is the device's last will, or a
    gateway says that the device does not answer.

    The notice may come late, so it is only additional information. For example, a broker publishes a
    last will only after one and a half keepalive periods of silence.
    """

    topic: Annotated[Topic, tells("where the notice is published.")]
    offline: Annotated[
        list[Payload],
        msgspec.Meta(min_length=1),
        tells("the payloads which mean that the device has no connection (`offline`)."),
    ]


class StateTopic(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A topic where a device publishes a state. The payload is JSON, or a plain text or number."""

    topic: Annotated[Topic, tells("where the state is published.")]
    stale_after_s: Annotated[
        Age,
        tells("""a state that is older counts as unknown. Write a longer time than the device's own
        period, or than the device needs to answer `ask`."""),
    ]
    ask: Annotated[
        Ask | None, tells("a message, sent in every scan, that makes the device publish its state.")
    ] = None
    availability: Annotated[
        Availability | None,
        tells("the notice that the device has lost its connection to the broker."),
    ] = None


class Message(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One command to a device. The message is never retained."""

    topic: Annotated[Topic, tells("where the device listens.")]
    payload: Annotated[Payload, tells("the message.")] = ""
    qos: Annotated[
        Qos,
        tells(
            "1: the broker confirms the message, and repeats it to the device; 0: it does neither."
        ),
    ] = 1


class RelayCommand(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The messages that switch one relay. These messages are never retained."""

    topic: Annotated[Topic, tells("where the device listens.")]
    payload_on: Annotated[Payload, tells("the message that switches the relay on.")]
    payload_off: Annotated[Payload, tells("the message that switches the relay off.")]
    qos: Annotated[
        Qos,
        tells(
            """1: the broker confirms the message, and repeats it to the device; 0: the broker does
        neither."""
        ),
    ] = 1

    def problems(self) -> Remarks:
        """Yield a problem for two messages that are equal."""
        if self.payload_on == self.payload_off:
            yield ("payload_off",), "is the same message as payload_on"

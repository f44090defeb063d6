"""The settings of an MQTT bus in a device YAML (`type: mqtt`): the broker, its secrets, and its
points."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Literal

import msgspec

from bridges.kinds.shared.fields import AbsolutePath, Name, Period, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from bridges.yaml.spelling import unknown
from drivers.hal import BusSettings, Needs, Where
from drivers.hal.hosts import misspelt_host, one_spelling
from drivers.hal.mqtt.points import MqttPoint
from drivers.hal.mqtt.topics import TOPICS_MAX, RelayCommand
from drivers.hal.points import Wire

Confirmation = Annotated[float, msgspec.Meta(ge=0.1, le=5, extra={"unit": "s"})]
"""The longest wait for a confirmation. It is at most 5 s, because systemd could restart a daemon that
waits longer (`WatchdogSec=10` of the unit)."""
RENEWED = 3
"""The minimum time of a relay's timer, as a number of scans. The driver restarts the timer in every
scan."""


class BrokerTls(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """TLS to the broker. The broker's certificate must be valid for `host`."""

    ca_file: Annotated[
        AbsolutePath | None,
        tells("""a PEM file with the certificate of the broker or of its authority. Without this
        file the public authorities are trusted."""),
    ] = None
    certificate_file: Annotated[
        AbsolutePath | None,
        tells("a PEM file with the daemon's certificate, for a broker that requires one."),
    ] = None
    key_file: Annotated[
        AbsolutePath | None,
        tells(
            "a PEM file with the private key of this certificate, which only the daemon may read."
        ),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem for a client certificate without its key, or a key without its
        certificate."""
        if bool(self.certificate_file) != bool(self.key_file):
            key = "key_file" if self.key_file else "certificate_file"
            yield (key,), "certificate_file and key_file need each other"


class MqttSettings(BusSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="mqtt"):
    """A broker, and the contacts and relays of devices that are connected to the broker."""

    host: Annotated[Name, tells("the broker's address or name.")]
    port: Annotated[
        Annotated[int, msgspec.Meta(ge=1, le=65535)] | None,
        tells("the TCP port; 1883 when absent, or 8883 with tls."),
    ] = None
    version: Annotated[
        Literal["5", "3.1.1"],
        tells("""the version of MQTT. Only with version 5 the broker does three things: it holds long
        payloads back, it drops a command that it cannot deliver at once, and it reports that no
        device receives a command."""),
    ] = "5"
    tls: Annotated[
        BrokerTls | None, tells("encryption, and the authorities that the daemon trusts.")
    ] = None
    user: Annotated[Name | None, tells("the daemon's user name at the broker.")] = None
    password_file: Annotated[
        Name | None, tells("a file with the user's password, which only the daemon may read.")
    ] = None
    client_id: Annotated[
        Name | None,
        tells("""the daemon's client id, for a broker that grants rights by client id. Without it the
        id is random."""),
    ] = None
    keepalive_s: Annotated[
        int,
        msgspec.Meta(ge=1, le=60, extra={"unit": "s"}),
        tells("after this time without a message the daemon sends a ping to the broker."),
    ] = 5
    timeout_s: Annotated[
        Confirmation, tells("how long a connection, or the broker's confirmation, may take.")
    ] = 1.0
    scan_s: Annotated[
        Period, tells("the period at which the daemon checks the states, and asks for them.")
    ] = 0.5
    points: Annotated[
        dict[Name, MqttPoint],
        tells("name -> a contact or relay. A device's `point:` gives this name."),
    ] = msgspec.field(default_factory=dict)

    def wholes(self) -> Mapping[str, MqttPoint]:
        """Return the points, completed from their profiles. Leave out points that have problems."""
        valid = {name: point for name, point in self.points.items() if not any(point.problems())}
        return {name: point.whole() for name, point in valid.items()}

    def problems(self) -> Remarks:
        """Yield problems that involve more than one key."""
        if reason := misspelt_host(self.host):
            yield ("host",), reason
        if self.password_file and not self.user:
            yield ("password_file",), "needs user: the name that the password belongs to"
        points = self.wholes()
        if len(points) > TOPICS_MAX // 2:
            yield (
                ("points",),
                f"at most {TOPICS_MAX // 2} points fit on one bus: define a second bus",
            )
        yield from _used_twice(points)
        yield from self._late_renewals()

    def _late_renewals(self) -> Remarks:
        least_s = RENEWED * self.scan_s + self.timeout_s
        for name, point in self.points.items():
            off_s = point.switches_off_after_s
            if off_s is not None and off_s < least_s:
                text = (
                    f"is {off_s:g}, but the daemon restarts the timer every {self.scan_s:g} s (scan_s):"
                    " write at least"
                )
                path = ("points", name, "switches_off_after_s")
                yield path, f"switches_off_after_s {text} {least_s:g}"

    def address(self) -> tuple[str, int]:
        """Return the broker's host and port."""
        return self.host, self.port or (8883 if self.tls else 1883)


def _used_twice(points: Mapping[str, MqttPoint]) -> Remarks:
    """Yield a problem for a state or command that two points use. Yield a problem for a command topic
    that is also a state topic."""
    states = {point.topic: name for name, point in points.items() if point.topic}
    first: dict[object, str] = {}
    for name, point in points.items():
        for key, use in _uses(point):
            other = first.setdefault(use, name)
            if other != name:
                yield _at(points[name], name, key), f"is the same {key} as that of '{other}'"
        for key, topic in _written(point):
            if topic in states:
                whose = f"{topic} is the state topic of '{states[topic]}'"
                yield (
                    _at(point, name, key),
                    f"{whose}: the daemon would read the {key} as a state",
                )


def _uses(point: MqttPoint) -> Iterator[tuple[str, object]]:
    if point.topic:
        yield "topic", ("state", point.topic, point.field, str(point.when))
    if point.command:
        yield "command", ("command", *_relay(point.command))


def _written(point: MqttPoint) -> Iterator[tuple[str, str]]:
    if point.command:
        yield "command", point.command.topic
    if point.ask:
        yield "ask", point.ask.topic


def _at(point: MqttPoint, name: str, key: str) -> tuple[str, ...]:
    """Return the path of a point's key in the YAML. If the key comes from a profile, return the path of
    `part`."""
    if point.profile:
        return "points", name, "part"
    return ("points", name, key) if key == "topic" else ("points", name, key, "topic")


def warnings(settings: MqttSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    if settings.password_file and not settings.tls:
        text = "the password goes over the network unencrypted: add tls if the broker supports it"
        yield ("password_file",), text
    for name, point in settings.wholes().items():
        path = ("points", name)
        if point.without_timer:
            yield (
                (*path, "without_timer"),
                f"unsafe relay '{name}' is accepted: {point.without_timer}",
            )
        if point.command is None:
            continue
        if point.switches_off_after_s is not None:
            text = "pull the network plug while the relay is on: it must go off within this time"
            yield (*path, "switches_off_after_s"), text
        if point.topic is None:
            yield path, f"'{name}' has no topic for its state: switching off is not verified"
        if settings.version == "3.1.1" and point.command.qos == 1:
            text = (
                f"when the device of '{name}' returns to its session, it gets an old 'on': write"
                ' version: "5", which drops late commands, or qos: 0'
            )
            yield path, text


def needs(settings: MqttSettings) -> Needs:
    """Return the permission to reach the broker's address."""
    return Needs(host=settings.host)


def where(settings: MqttSettings) -> Where:
    """Return the broker's address, which is the hardware that the bus uses."""
    host, port = settings.address()
    return Where(f"{one_spelling(host)}:{port}", local=False)


def claims(settings: MqttSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the daemon's client id, with its path in the YAML. A broker ends the connection of the
    client that had the id before."""
    if settings.client_id:
        yield f"client id {settings.client_id}", ("client_id",)


def unfit(settings: MqttSettings, point: str, direction: Literal["in", "out"]) -> str | None:
    """Return the reason why this point cannot be an input, or cannot be an output. Return None if it
    can."""
    if point not in settings.points:
        return unknown("point", point, settings.points)
    whole = settings.wholes().get(point)
    if whole is None:
        return None  # the check of the point itself reports its problems
    if direction == "in" and whole.topic is None:
        return f"'{point}' has no topic, so its state cannot be read: add topic to it"
    if direction == "out" and whole.command is None:
        return f"'{point}' has no command, so it cannot be switched: add command to it"
    return None


def place(settings: MqttSettings, point: str) -> str | None:
    """Return a text that names a relay's command, because no other device YAML may send the same
    command. Return None for a state, because every device YAML may read a state."""
    whole = settings.wholes().get(point)
    command = whole.command if whole else None
    return f"the command {' '.join(_relay(command))}" if command else None


def _relay(command: RelayCommand) -> tuple[str, str]:
    """Return the topic and the message that switch a relay off. The message that switches the relay on
    also has the time of the relay's timer."""
    return command.topic, command.payload_off


def wire_problems(wire: Wire) -> Iterable[str]:
    """Yield the errors in this wire on MQTT."""
    if wire.pull is not None:
        yield "pull is for GPIO pins: delete pull"
    if wire.flash is not None:
        yield "flash is only for Modbus modules: use the relay's own timer"
    if not wire.read_back:
        yield "read_back is only for coils; a point without topic is never read back: delete it"
    if wire.direction == "out" and wire.active == "low":
        yield "write active: high, because the point's payload_on already says how to switch on"


def tables(settings: MqttSettings) -> Iterable[Table]:
    """Yield a table of the topics of each point."""
    rows = []
    for name, point in settings.wholes().items():
        state = " ".join(filter(None, (point.topic, point.field))) or "-"
        age = "-" if point.stale_after_s is None else f"{point.stale_after_s:g} s"
        sent = "-"
        if point.command:
            sent = f"{point.command.topic}: {point.command.payload_on or '(empty)'}"
        timer = point.switches_off_after_s
        rows.append((name, state, age, sent, "-" if timer is None else f"{timer:g} s"))
    heads = ("point", "state", "stale after", "on", "off by itself after")
    if rows:
        yield Table("topics", heads, tuple(rows))

"""The settings of devices that may tell the fleets of an alarm, and the messages of that alarm."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Final, Literal

import msgspec

from bridges.kinds.shared.fields import DeviceSettings, Name, tells
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmHeard,
    AlarmStated,
    FleetAlarmLimits,
    FleetAlarmReport,
    Fleets,
)
from bridges.kinds.shared.remarks import Remarks
from bridges.messages.definitions import Bool, DiagnosticArray, EmergencySignal, Message
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER, Topic

AlarmTopic = Literal["fire_alarm_trigger", "emergency_signal"]
TOPICS: Final[Mapping[str, Topic[Message]]] = {
    topic.name: topic for topic in (FIRE_ALARM_TRIGGER, EMERGENCY_SIGNAL)
}
STATE, FLEETS, CAUSES, SINCE = "alarm state", "alarm fleets", "alarm causes", "alarm since"
"""The keys with which a daemon states its alarm on `/diagnostics`. The status file has the same words
below `alarm`."""
RAISED: Final = frozenset({"alarm", "drill"})


class AlarmingSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of every device that may raise an alarm for the fleets."""

    alarm: Annotated[
        Literal["none", AlarmTopic],
        tells(
            "the topic that tells the fleets of an alarm; `none` if the site wants no such topic."
        ),
    ] = "none"
    fleets: Annotated[
        tuple[Name, ...],
        tells("""the fleets that are told of the alarm, by their names in RMF. When absent, all fleets
        are told. Only the topic `emergency_signal` can name fleets."""),
    ] = ()
    without_fleets: Annotated[
        Literal["tell_all", "tell_nobody"] | None,
        tells("""the effect of an alarm with `fleets` if RMF's release has no `emergency_signal` (Jazzy
        and older). `tell_all`: all fleets of the graph stop. `tell_nobody`: no fleet is told."""),
    ] = None


def alarm_topics(settings: object) -> tuple[Topic[Message], ...]:
    """Return the topic that tells the fleets of a device's alarm; empty if the device tells nobody."""
    alarms = isinstance(settings, AlarmingSettings) and settings.alarm != "none"
    return (TOPICS[settings.alarm],) if alarms else ()  # type: ignore[attr-defined]


def alarm_problems(settings: AlarmingSettings) -> Remarks:
    """Yield contradictions between the topic and the fleets."""
    if settings.fleets and settings.alarm != EMERGENCY_SIGNAL.name:
        text = "only emergency_signal names fleets: write alarm: emergency_signal, or delete fleets"
        yield ("fleets",), text
    elif settings.fleets and settings.without_fleets is None:
        text = (
            "Jazzy and older have no emergency_signal, and fire_alarm_trigger stops every fleet: write"
            " without_fleets: tell_all, or without_fleets: tell_nobody"
        )
        yield ("fleets",), text
    if settings.without_fleets and not settings.fleets:
        yield (
            ("without_fleets",),
            "has an effect only with fleets, and all fleets are told: delete without_fleets",
        )


def alarm_limits(devices: Mapping[str, AlarmingSettings]) -> FleetAlarmLimits | None:
    """Return the settings of the one alarm that all devices of a file raise; None if no device tells
    the fleets. The loader has already checked with `disagreements` that the devices agree on the
    topic and the fleets."""
    alarming = {name: one for name, one in devices.items() if one.alarm != "none"}
    if not alarming:
        return None
    one = next(iter(alarming.values()))
    return FleetAlarmLimits(TOPICS[one.alarm], frozenset(one.fleets), frozenset(alarming))


def disagreements(devices: Mapping[str, AlarmingSettings]) -> Iterator[tuple[str, str]]:
    """Yield (device, text) for each device whose alarm differs from the alarm of the file's first
    device."""
    alarming = [(name, one) for name, one in devices.items() if one.alarm != "none"]
    for name, one in alarming[1:]:
        first = alarming[0][1]
        if (one.alarm, set(one.fleets), one.without_fleets) != (
            first.alarm,
            set(first.fleets),
            first.without_fleets,
        ):
            text = (
                f"all devices of a file share one alarm, but '{alarming[0][0]}' has another alarm"
            )
            yield name, f"{text}: give both the same alarm and fleets, or put them into two files"


def is_alarm(topic: str, message: object) -> bool:
    """Return whether a message on this topic raises or ends an alarm. `topic`: its name in RMF."""
    fire = isinstance(message, Bool) and topic == FIRE_ALARM_TRIGGER.name
    return fire or isinstance(message, EmergencySignal)


def heard(message: Message, senders: Iterable[str]) -> AlarmHeard:
    """Turn a message on an alarm's topic into an event."""
    if isinstance(message, EmergencySignal):
        on, fleets = message.is_emergency, frozenset(message.fleet_names)
    else:
        assert isinstance(message, Bool)
        on, fleets = message.data, frozenset[str]()
    return AlarmHeard(frozenset(sender.lstrip("/") for sender in senders), on, fleets)


def statement(report: FleetAlarmReport, fleets: Fleets) -> dict[str, str]:
    """Return the keys and texts with which the daemon states its alarm, for the status file and
    `/diagnostics`."""
    causes = ", ".join(map(str, report.causes))
    told = msgspec.json.encode(sorted(fleets)).decode()
    return {"state": report.state, "fleets": told, "causes": causes or "-"}


def stated(message: DiagnosticArray) -> Iterator[AlarmStated]:
    """Yield what our daemons state about their alarms in a message of `/diagnostics`. A message may
    have no such statement."""
    for node, state, fleets in statements(message):
        yield AlarmStated(node, state in RAISED, fleets)


def statements(message: DiagnosticArray) -> Iterator[tuple[str, str, Fleets]]:
    """Yield the node, the state and the fleets of each alarm that a message of `/diagnostics`
    states."""
    for status in message.status:
        values = {pair.key: pair.value for pair in status.values}
        if STATE in values:
            fleets = fleets_in(values.get(FLEETS, ""))
            yield status.hardware_id.lstrip("/"), values[STATE], fleets


def fleets_in(text: str) -> Fleets:
    """Return the fleets in the text of a statement. If `statement` did not write the text, return the
    empty set, which means all fleets."""
    try:
        return frozenset(msgspec.json.decode(text, type=list[str]))
    except msgspec.MsgspecError:
        return frozenset()


def alarm_notes(settings: AlarmingSettings) -> Remarks:
    """Yield a note for each effect of the alarm that the site should know."""
    if settings.alarm != "none" and not settings.fleets:
        text = "an alarm stops the robots of every fleet on this graph, in every building of it"
        yield ("alarm",), f"{text}; to stop fewer fleets, write alarm: emergency_signal and fleets"
    if settings.without_fleets == "tell_all":
        yield (
            ("without_fleets",),
            "under Jazzy and older an alarm stops every fleet, not only these",
        )
    if settings.without_fleets == "tell_nobody":
        yield ("without_fleets",), "under Jazzy and older an alarm stops no robot"

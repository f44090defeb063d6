"""The `mqtt` bus in a YAML file: the errors of `check` with line and column, and the warnings of
`check`."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivers.hal.mqtt import BUS
from drivers.hal.mqtt.makes import MAKES, Profile
from drivers.hal.mqtt.points import MqttPoint
from tests.drivers.hal.mqtt.broker import RELAY, settings
from tests.settings.reading import problems_of

EXAMPLE = Path(__file__).parents[4] / "config" / "door_mqtt.yaml"
STATE = {"topic": "a/state", "stale_after_s": 5}


def problems(points: dict[str, Any], **more: Any) -> list[tuple[tuple[str, ...], str]]:
    """Return the problems that `check` finds in a bus with these points."""
    return list(settings(1883, points, **more).problems())


def point_problems(**keys: Any) -> list[tuple[tuple[str, ...], str]]:
    return list(msgspec.convert(keys, MqttPoint).problems())


@pytest.mark.parametrize(
    "topic", ["a/#", "+/state", "#", "$SYS/uptime", "", " a", "a ", "a\n", "a\x00b", "x" * 257]
)
def test_a_topic_with_a_wildcard_or_an_odd_character_is_refused(topic: str) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"topic": topic, "stale_after_s": 5}, MqttPoint)


def test_a_state_needs_its_age() -> None:
    [(path, text)] = point_problems(topic="a")
    assert (path, text) == ((), "needs stale_after_s: the age from which this state is unknown")


def test_the_values_for_on_and_off_need_each_other_and_differ() -> None:
    text = "needs when_not, and when_not needs when: a value in neither list is a fault"
    assert point_problems(**STATE, when=["ON"]) == [(("when",), text)]
    assert point_problems(**STATE, when=["on"], when_not=["off"]) == []
    told = "write 1 without quotes: this payload is a number, true, false or null"
    assert point_problems(**STATE, when=["1"], when_not=["off"]) == [(("when",), told)]
    assert point_problems(**STATE, field="x", when=["1"], when_not=["0"]) == []
    both = point_problems(**STATE, when=["ON", 1], when_not=[1])
    assert both == [(("when_not",), "1 is in when too")]


def test_a_relay_without_a_timer_needs_a_reason() -> None:
    bare = {k: v for k, v in RELAY.items() if k != "switches_off_after_s"}
    [(path, text)] = point_problems(**bare)
    assert path == ()
    assert text.startswith(
        "unsafe: nothing switches this relay off when the network or the broker fails"
    )
    assert point_problems(**bare, without_timer="the lock opens by hand") == []


def test_a_profile_needs_a_device_and_a_part_that_the_make_has() -> None:
    assert point_problems(profile="tasmota", device="d")[0][0] == ("profile",)
    found = {"profile": "shelly-gen2", "device": "d", "stale_after_s": 5}
    assert point_problems(**found, part="relay:0") == [
        (
            ("part",),
            "'relay:0' is no relay or input of this make: write switch:0 or input:0",
        )
    ]
    assert point_problems(**STATE, part="x") == [
        (("part",), "is only for points with a profile: add profile, or delete this key")
    ]


def test_a_topic_used_twice_is_refused_at_the_second_use() -> None:
    twice = {"a": STATE, "b": STATE, "c": {**STATE, "field": "x"}}
    assert problems(twice) == [(("points", "b", "topic"), "is the same topic as that of 'a'")]
    other = {**RELAY, "topic": "other/state"}
    assert problems({"a": RELAY, "b": other}) == [
        (("points", "b", "command", "topic"), "is the same command as that of 'a'")
    ]


def test_a_command_topic_that_is_a_states_is_refused() -> None:
    command = {"topic": "a/state", "payload_on": "1", "payload_off": "0"}
    relay = {"command": command, "without_timer": "a lamp"}
    assert problems({"a": STATE, "b": relay}) == [
        (
            ("points", "b", "command", "topic"),
            "a/state is the state topic of 'a': the daemon would read the command as a state",
        )
    ]


def test_a_timer_shorter_than_three_scans_and_an_answer_is_refused() -> None:
    [(path, text)] = problems({"a": {**RELAY, "switches_off_after_s": 2}}, scan_s=0.5)
    assert path == ("points", "a", "switches_off_after_s")
    assert text.endswith(
        "is 2, but the daemon restarts the timer every 0.5 s (scan_s): write at least 2.5"
    )


def test_a_password_needs_a_user_and_a_certificate_its_key() -> None:
    assert problems({}, password_file="x")[0][0] == ("password_file",)
    found = settings(1883, tls={"key_file": "/k"}).tls
    assert found
    assert list(found.problems()) == [
        (("key_file",), "certificate_file and key_file need each other")
    ]


def test_the_port_is_that_of_the_protocol_unless_given() -> None:
    assert BUS.where(settings(1883))
    plain = msgspec.structs.replace(settings(1), port=None)
    assert plain.address() == ("127.0.0.1", 1883)
    with_tls = settings(1, tls={})
    assert msgspec.structs.replace(with_tls, port=None).address() == ("127.0.0.1", 8883)


def test_warnings_name_what_an_integrator_should_look_at() -> None:
    bare = {"command": RELAY["command"], "without_timer": "a lamp"}
    found = settings(
        1883, {"relay": RELAY, "lamp": bare}, version="3.1.1", user="u", password_file="f"
    )
    assert [(path[-1], text.split(":")[0]) for path, text in BUS.warnings(found)] == [
        ("password_file", "the password goes over the network unencrypted"),
        (
            "switches_off_after_s",
            "pull the network plug while the relay is on",
        ),
        ("relay", "when the device of 'relay' returns to its session, it gets an old 'on'"),
        ("without_timer", "unsafe relay 'lamp' is accepted"),
        ("lamp", "'lamp' has no topic for its state"),
        ("lamp", "when the device of 'lamp' returns to its session, it gets an old 'on'"),
    ]


@pytest.mark.parametrize(
    ("profile", "part", "payloads"),
    [
        ("shelly-gen2", "switch:0", [b'{"id":0,"output":true}', b'{"id":0,"output":false}']),
        ("shelly-gen2", "input:1", [b'{"id":1,"state":true}', b'{"id":1,"state":false}']),
        ("tasmota", "POWER1", [b"ON", b"OFF"]),
        (
            "tasmota",
            "Switch1",
            [b'{"StatusSNS":{"Switch1":"ON"}}', b'{"StatusSNS":{"Switch1":"OFF"}}'],
        ),
        ("zigbee2mqtt", "state", [b'{"state":"ON","linkquality":92}', b'{"state":"OFF"}']),
        ("zigbee2mqtt", "contact", [b'{"contact":true,"battery":97}', b'{"contact":false}']),
    ],
)
def test_a_profile_decodes_the_payloads_of_its_make(
    profile: Profile, part: str, payloads: list[bytes]
) -> None:
    keys = {"profile": profile, "device": "d", "part": part, "stale_after_s": 5}
    if "command" in MAKES[profile]("d", part, None):
        keys["switches_off_after_s"] = 10
    point = msgspec.convert(keys, MqttPoint)
    assert list(point.problems()) == []
    assert [point.whole().asserted(payload) for payload in payloads] == [True, False]


def test_the_commands_of_the_makes_carry_the_timer_where_the_make_takes_it() -> None:
    sent = {(profile, part): MAKES[profile]("d", part, 10)["command"] for profile, part in RELAYS}
    rpc = '{"id": 1, "src": "rmf-bridges", "method": "Switch.Set", "params": '
    assert sent == {
        ("shelly-gen2", "switch:0"): {
            "topic": "d/rpc",
            "payload_on": rpc + '{"id": 0, "on": true, "toggle_after": 10}}',
            "payload_off": rpc + '{"id": 0, "on": false}}',
        },
        ("tasmota", "POWER"): {"topic": "cmnd/d/POWER", "payload_on": "ON", "payload_off": "OFF"},
        ("zigbee2mqtt", "state"): {
            "topic": "zigbee2mqtt/d/set",
            "payload_on": '{"state": "ON", "on_time": 10}',
            "payload_off": '{"state": "OFF"}',
        },
    }


RELAYS: list[tuple[Profile, str]] = [
    ("shelly-gen2", "switch:0"),
    ("tasmota", "POWER"),
    ("zigbee2mqtt", "state"),
]


# ---- in a whole file


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "{point: input 0,",
            "{point: inptu 0,",
            "37:23: unknown point 'inptu 0': did you mean 'input 0'?"
            " known here: relay, input 0, input 1",
        ),
        (
            "{point: input 0,",
            "{point: input 0, pull: up,",
            "37:7: 'opened': pull is for GPIO pins: delete pull",
        ),
        (
            "{point: relay, active: high}",
            "{point: relay, active: low}",
            "40:7: 'hold_open': write active: high, because the point's payload_on already says"
            " how to switch on",
        ),
        (
            "{point: relay,",
            "{point: input 1,",
            "40:26: 'input 1' has no command, so it cannot be switched: add command to it",
        ),
        (
            "part: input:1",
            "part: input:0",
            "31:15: 'part' is the same topic as that of 'input 0'",
        ),
        (
            "device: shellyplus2pm-a0b1c2d3e4f5\n        part: input:1",
            "device: shellyplus2pm/#\n        part: input:1",
            "30:17: 'device' is 'shellyplus2pm/#': write one whole topic, without the wildcards"
            " # and + (door-1/status/input:0)",
        ),
    ],
)
def test_a_problem_has_its_line_and_column(
    tmp_path: Path, old: str, new: str, problem: str
) -> None:
    text = EXAMPLE.read_text()
    assert old in text
    assert problem in problems_of(tmp_path / "door.yaml", text.replace(old, new, 1))

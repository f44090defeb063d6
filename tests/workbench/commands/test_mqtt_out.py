"""`mqtt-out` as a process between a ROS graph of RMF and a real broker. The tests kill and restart the
broker."""

import argparse
import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from bridges.cli import main
from bridges.kinds.shared.rmf_section import Rmf
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.transports.choose import open_transport
from bridges.transports.transport import TransportError
from hal_fakes.mosquitto import Mosquitto, end
from hal_fakes.wire import runs_here
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.waiting import wait_until
from workbench.commands import mqtt_out as mqtt_out_command
from workbench.graph import retained

DOOR = d.DoorState(d.Time(1), "ward", d.DoorMode(0))
STATE, AVAILABLE, STATUS = "rmf/door/ward/state", "rmf/door/ward/availability", "rmf/status"
CONFIG = "homeassistant/device/rmf_door_ward/config"


class Reader:
    """A new client that reads the retained messages of the broker."""

    def __init__(self, broker: Mosquitto, user: str = "", password: str = "") -> None:
        self.retained: dict[str, str] = {}
        self._client = paho.Client(CallbackAPIVersion.VERSION2, protocol=paho.MQTTv5)
        self._client.on_message = self._take
        self._client.on_connect = lambda client, *_: client.subscribe("#", 1)
        if user:
            self._client.username_pw_set(user, password)
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()

    def _take(self, client: paho.Client, userdata: object, message: paho.MQTTMessage) -> None:
        self.retained[message.topic] = message.payload.decode()

    def close(self) -> None:
        self._client.disconnect()
        end(self._client)


@contextmanager
def reader(broker: Mosquitto, user: str = "", password: str = "") -> Iterator[Reader]:
    made = Reader(broker, user, password)
    try:
        yield made
    finally:
        made.close()


def holds(broker: Mosquitto, **wanted: str) -> None:
    """Wait until the broker retains these payloads for every new client."""
    with reader(broker) as found:
        wait_until(
            lambda: all(found.retained.get(topic) == said for topic, said in wanted.items()),
            f"the broker holds {wanted}",
        )


@contextmanager
def mqtt_out(broker: Mosquitto, domain: int, *options: str) -> Iterator[subprocess.Popen[str]]:
    """Run the command until the `with` block ends."""
    words = [sys.executable, "-m", "bridges.cli", "mqtt-out", f"127.0.0.1:{broker.port}", *options]
    words += ["--domain-id", str(domain), "--localhost", "--transport", runs_here()]
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def door(domain: int) -> Iterator["Door"]:
    made = Door(domain)
    try:
        yield made
    finally:
        made.node.close()


class Door:
    """A node that publishes the states of one door. The node publishes no diagnostics."""

    def __init__(self, domain: int) -> None:
        self.node = open_transport(
            Rmf(transport=runs_here(), domain_id=domain), "door", localhost=True
        )
        self._states = self.node.publisher(topics.DOOR_STATES)

    def says(self, mode: int) -> None:
        """Publish a state with the present time as its stamp."""
        wall = self.node.wall()
        stamp = d.Time(int(wall), int(wall % 1 * 1e9))
        self._states.publish(d.DoorState(stamp, "ward", d.DoorMode(mode)))

    def is_shown(self, broker: Mosquitto, mode: int, word: str) -> None:
        """Publish this state again and again, until the broker retains it."""
        with reader(broker) as found:

            def shown() -> bool:
                self.says(mode)
                state = json.loads(found.retained.get(STATE) or "{}")
                online = found.retained.get(AVAILABLE) == found.retained.get(STATUS) == "online"
                return bool(online and state.get("mode") == word)

            wait_until(shown, f"the broker holds the door as {word}")


@pytest.fixture
def broker() -> Iterator[Mosquitto]:
    made = Mosquitto()
    yield made
    made.close()


def test_a_broker_that_is_killed_and_restarted_holds_everything_again(
    broker: Mosquitto, domain: int
) -> None:
    with door(domain) as ward, mqtt_out(broker, domain, "--home-assistant") as process:
        ward.is_shown(broker, 0, "closed")
        broker.kill()
        ward.says(2)
        broker.start()
        ward.is_shown(broker, 2, "open")
        with reader(broker) as found:
            wait_until(lambda: CONFIG in found.retained, "discovery is there again")
        assert process.poll() is None
        process.terminate()
        _, errors = process.communicate()
        assert f"broker 127.0.0.1:{broker.port} is gone" in errors
        assert process.returncode == 0
    holds(broker, **{STATUS: "offline"})


def test_what_a_restarted_broker_has_lost_is_published_at_once_and_not_only_renewed(
    broker: Mosquitto, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retained, "RENEWED_S", float("inf"))
    network = MemoryNetwork()
    node = MemoryTransport(network, "mqtt_out")
    states = MemoryTransport(network, "door").publisher(topics.DOOR_STATES)
    parser = argparse.ArgumentParser()
    mqtt_out_command.add_arguments(parser)
    out = mqtt_out_command.Broker(parser.parse_args([f"127.0.0.1:{broker.port}"]), STATUS)

    def run() -> None:
        with pytest.raises(TransportError):
            mqtt_out_command.publish(node, out, retained.Retainer("rmf", None))

    def holds_all() -> None:
        with reader(broker) as found:

            def shown() -> bool:
                states.publish(DOOR)
                return {STATUS, STATE, AVAILABLE} <= found.retained.keys()

            wait_until(shown, "the broker holds everything")

    thread = threading.Thread(target=run)
    thread.start()
    holds_all()
    for _ in range(2):
        broker.kill()
        broker.start()
        holds_all()
    node.close()
    thread.join()
    out.close()


def test_a_door_that_falls_silent_is_offline_and_a_killed_publisher_by_its_last_will(
    broker: Mosquitto, domain: int
) -> None:
    with mqtt_out(broker, domain) as process:
        with door(domain) as ward:
            ward.is_shown(broker, 0, "closed")
        holds(broker, **{AVAILABLE: "offline", STATUS: "online"})
        process.kill()
        holds(broker, **{STATUS: "offline"})


def test_a_broker_that_comes_late_gets_everything(broker: Mosquitto, domain: int) -> None:
    broker.kill()
    with door(domain) as ward, mqtt_out(broker, domain) as process:
        assert process.stderr is not None
        assert f"127.0.0.1:{broker.port} does not answer" in process.stderr.readline()
        broker.start()
        ward.is_shown(broker, 0, "closed")


def test_it_publishes_with_the_right_to_write_alone_and_subscribes_to_nothing(
    tmp_path: Path, domain: int
) -> None:
    log, acl, users = tmp_path / "log", tmp_path / "acl", tmp_path / "users"
    acl.write_text("user out\ntopic write rmf/#\nuser all\ntopic read #\n")
    users.touch(mode=0o600)
    for name, password in (("out", "right"), ("all", "other")):
        subprocess.run(["mosquitto_passwd", "-b", users, name, password], check=True)
    secret = tmp_path / "password"
    secret.touch(mode=0o600)
    secret.write_text("wrong\n")
    lines = [f"password_file {users}", f"acl_file {acl}", "allow_anonymous false"]
    broker = Mosquitto([*lines, f"log_dest file {log}", "log_type subscribe", "log_type error"])
    options = ("--user", "out", "--password-file", str(secret))
    try:
        with mqtt_out(broker, domain, *options) as process:
            assert process.stderr is not None
            said = process.stderr.readline()
            assert "refuses the connection: Not authorized" in said
            assert "wrong" not in said
        secret.write_text("right\n")
        with (
            door(domain) as ward,
            mqtt_out(broker, domain, *options),
            reader(broker, "all", "other") as found,
        ):

            def shown() -> bool:
                ward.says(0)
                return STATE in found.retained

            wait_until(shown, "the state is published")
        subscribed = [line for line in log.read_text().splitlines() if line.endswith(" #")]
        assert len(subscribed) == len(log.read_text().splitlines()) == 1
    finally:
        broker.close()


@pytest.mark.parametrize(
    ("options", "code", "wanted"),
    [
        (["10.0.0.5", "--user", "a", "--password-file", "f"], 64, "give --tls, or"),
        (["10.0.0.5", "--user", "a"], 64, "need each other"),
        (["10.0.0.5", "--ca-file", "f"], 64, "--ca-file is for --tls"),
        (["127.0.0.1", "--user", "a", "--password-file", "/nowhere"], 78, "cannot be read"),
        (["10.0.0.5", "--tls", "--ca-file", "/nowhere"], 78, "/nowhere"),
    ],
)
def test_options_that_would_show_a_secret_or_name_no_file_are_refused(
    options: list[str], code: int, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["mqtt-out", *options]) == code
    assert wanted in capsys.readouterr().err


@pytest.mark.parametrize("options", [["a b"], ["h:0"], ["h:70000"], ["h", "--prefix", "rmf/#"]])
def test_an_impossible_broker_or_prefix_is_refused(options: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["mqtt-out", *options])
    assert ended.value.code == 2

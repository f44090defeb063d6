"""`rmf-bridge mqtt-out`: publish the lifts, doors and chargers of RMF's graph to an MQTT broker.

The command subscribes to no topic, so nobody can command a device through the broker. The broker must
speak MQTT 5. `workbench/graph/retained.py` makes the messages.
"""

import argparse
import os
import re
import threading
import time
from contextlib import closing, suppress
from typing import TYPE_CHECKING, Any, Final

from bridges.observe.all_devices import PlainGraph
from bridges.system import user_files
from bridges.system.installed import how_to_install
from bridges.transports.transport import Transport, TransportError
from drivers.hal.hosts import is_loopback
from workbench.commands.watch import listen_on
from workbench.graph.board import Board
from workbench.graph.join import add_graph_arguments, complain, interruptible, open_graph
from workbench.graph.retained import EXPIRES_S, Retained, Retainer, ShownDevice

if TYPE_CHECKING:
    from paho.mqtt.client import Client

TURN_S: Final = 0.5
KEEPALIVE_S: Final = 10
WAITING: Final = 5000
"""Maximum number of messages that wait for a slow broker. The rest is published TURN_S later."""
LEAVES_S: Final = 2.0
PORTS: Final = {False: 1883, True: 8883}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mqtt-out`."""
    parser.add_argument(
        "broker",
        type=_broker,
        metavar="HOST[:PORT]",
        help="the broker; the default port is 1883, and 8883 with TLS",
    )
    parser.add_argument("--user", metavar="NAME", help="a user of the broker, who may only publish")
    parser.add_argument(
        "--password-file",
        metavar="FILE",
        help="a file with the user's password, which only you may read",
    )
    parser.add_argument("--tls", action="store_true", help="use TLS")
    parser.add_argument(
        "--ca-file",
        metavar="FILE",
        help="the certificate of the broker's authority (PEM), for --tls",
    )
    parser.add_argument(
        "--accept-unencrypted",
        action="store_true",
        help="send the password without TLS, if nobody else uses the network",
    )
    parser.add_argument(
        "--prefix", type=_prefix, default="rmf", help="the first part of the topics (default: rmf)"
    )
    parser.add_argument(
        "--home-assistant",
        type=_prefix,
        nargs="?",
        const="homeassistant",
        metavar="PREFIX",
        help="publish Home Assistant's discovery too (default PREFIX: homeassistant)",
    )
    add_graph_arguments(parser)


def _broker(text: str) -> tuple[str, int | None]:
    found = re.fullmatch(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9_.-]{1,253})(?::([0-9]{1,5}))?", text)
    if not found or (found[2] and not 1 <= int(found[2]) <= 65535):
        raise argparse.ArgumentTypeError(f"'{text}' is not HOST:PORT, such as 192.168.1.5:1883")
    return found[1].strip("[]"), int(found[2]) if found[2] else None


def _prefix(text: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}(/[A-Za-z0-9_-]{1,64}){0,7}", text):
        raise argparse.ArgumentTypeError(
            f"'{text}': write names of letters and digits, such as site/rmf"
        )
    return text


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: Ctrl-C or SIGTERM ended the program.
    - 1: the graph is lost.
    - 64, 69 or 78: the program could not start, and has printed the reason.
    """
    retainer = Retainer(args.prefix, args.home_assistant)
    if why := _unsafe(args):
        complain("mqtt-out", why)
        return os.EX_USAGE
    try:
        broker = Broker(args, retainer.status)
    except ImportError as error:
        complain("mqtt-out", f"{error}: {how_to_install('mqtt')}")
        return os.EX_UNAVAILABLE
    except user_files.SecretError as error:
        complain("mqtt-out", error)
        return os.EX_CONFIG
    except OSError as error:
        complain("mqtt-out", f"--ca-file {args.ca_file}: {error.strerror or error}")
        return os.EX_CONFIG
    try:
        with (
            interruptible(),
            closing(broker),
            closing(open_graph(args, "rmf_bridge_mqtt_out")) as transport,
        ):
            publish(transport, broker, retainer)
    except TransportError as error:
        complain("mqtt-out", error)
    except KeyboardInterrupt:
        return 0
    return 1


def _unsafe(args: argparse.Namespace) -> str:
    """Return the reason to refuse these options. Return "" for safe options."""
    if bool(args.user) != bool(args.password_file):
        return "--user and --password-file need each other"
    if args.ca_file and not args.tls:
        return "--ca-file is for --tls"
    readable = args.user and not args.tls and not is_loopback(args.broker[0])
    if readable and not args.accept_unencrypted:
        return (
            "the password would go over the network unencrypted: give --tls, or, where the network is"
            " yours alone, --accept-unencrypted"
        )
    return ""


def publish(transport: Transport, broker: "Broker", retainer: Retainer) -> None:
    """Publish until a signal interrupts the program. Raises TransportError when the graph is lost."""
    ear, graph = listen_on(transport), PlainGraph()
    board = Board(graph)
    while True:
        for heard in ear.listen(TURN_S):
            board.take(heard)
        if broker.is_new():
            retainer.forget()
        now, wall = time.monotonic(), time.time()
        young = board.unsettled(now)
        every = graph.stated()
        rows = board.rows_of(every, now, wall)
        settled = [
            ShownDevice(one, row)
            for one, row in zip(every, rows, strict=True)
            if (row.kind, row.name) not in young
        ]
        for message in retainer.due(settled, now, wall):
            if not broker.gives(message):
                break
            retainer.given(message, now)


class Broker:
    """A connection to a broker. After each loss, paho-mqtt connects again."""

    def __init__(self, args: argparse.Namespace, status: str) -> None:
        """Begin to connect.

        Raises ImportError without paho-mqtt, SecretError for an unusable password file, and OSError for
        an unreadable `ca_file`.
        """
        from paho.mqtt.client import Client, MQTTv5
        from paho.mqtt.enums import CallbackAPIVersion

        host, port = args.broker
        self._where = f"{host}:{port or PORTS[args.tls]}"
        self._status = status
        self._new = threading.Event()
        self._trouble = ""
        self._client = Client(CallbackAPIVersion.VERSION2, protocol=MQTTv5)
        if args.user:
            password = user_files.secret_line("--password-file", args.password_file, "password")
            self._client.username_pw_set(args.user, password)
        if args.tls:
            self._client.tls_set(args.ca_file)
        self._client.will_set(status, "offline", qos=1, retain=True)
        self._client.max_queued_messages_set(WAITING)
        self._client.reconnect_delay_set(1, 30)
        self._client.on_connect = self._connected
        self._client.on_connect_fail = lambda client, userdata: self._tell("does not answer")
        self._client.on_disconnect = self._lost
        self._client.connect_async(host, port or PORTS[args.tls], KEEPALIVE_S)
        self._client.loop_start()

    def is_new(self) -> bool:
        """Return whether paho-mqtt has made a new connection after the last call."""
        new = self._new.is_set()
        self._new.clear()
        return new

    def gives(self, message: Retained) -> bool:
        """Give a message to the broker. Return False if there is no connection, or if too many messages
        wait."""
        from paho.mqtt.packettypes import PacketTypes
        from paho.mqtt.properties import Properties

        if not self._client.is_connected():
            return False
        expires = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
        expires.MessageExpiryInterval = EXPIRES_S
        info = self._client.publish(message.topic, message.payload, 1, True, expires)
        return info.rc == 0

    def close(self) -> None:
        """Publish the message that `mqtt-out` has stopped, and disconnect. Never raises."""
        if self._client.is_connected():
            with suppress(RuntimeError, ValueError):  # on failure, the broker publishes the will
                self._client.publish(self._status, "offline", 1, True).wait_for_publish(LEAVES_S)
        self._client.disconnect()
        self._client.loop_stop()
        self._client.reinitialise()  # closes the sockets that loop_stop leaves open

    def _connected(
        self, client: "Client", userdata: Any, flags: Any, reason: Any, more: Any
    ) -> None:
        if reason.is_failure:
            self._tell(f"refuses the connection: {reason}")
            return
        self._trouble = ""
        self._new.set()

    def _lost(self, client: "Client", userdata: Any, flags: Any, reason: Any, more: Any) -> None:
        if reason.is_failure:
            self._tell(f"is gone: {reason}")

    def _tell(self, trouble: str) -> None:
        """Print a trouble, but not twice in a row. After a new connection, print the same trouble
        again."""
        if trouble != self._trouble:
            self._trouble = trouble
            complain("mqtt-out", f"broker {self._where} {trouble}")

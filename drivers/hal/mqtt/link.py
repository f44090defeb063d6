"""One connection to a broker, through paho, from the lookup of the name to the end. An ended connection
is never used again.

Each connection has a client of its own and a clean session, so it sends nothing of an earlier
connection. A single paho client would repeat unconfirmed messages after a reconnect, for example an
"on" of a minute ago. A thread serves the connection, and ends with the connection.

The protocol allows packets of 256 MB. With MQTT 5 the link tells the broker its limit (Maximum Packet
Size, section 3.1.2.11.4), and the broker holds longer packets back. MQTT 3.1.1 has no such limit. With
MQTT 3.1.1 the link ends the connection when a longer packet comes, and does not read its payload.
"""

import os
import socket
import ssl
import struct
import threading
from collections.abc import Callable, Iterable
from typing import Any, Final

import paho.mqtt.client as paho
from paho.mqtt import MQTTException
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode

from bridges.system import user_files
from drivers.hal.http_json import excerpt
from drivers.hal.mqtt.settings import BrokerTls, MqttSettings
from drivers.hal.mqtt.topics import PAYLOAD_MAX
from drivers.hal.points import HalError

PACKET_MAX: Final = PAYLOAD_MAX + 1024
"""The length (bytes) of the longest packet: a payload with its topic and properties."""
NOBODY: Final = 0x10
"""The code "no matching subscribers" (MQTT 5.0, 3.4.2.1). No device has received the message."""
TAKEN: Final = ""
ACKS_MAX: Final = 256
"""The maximum number of confirmations that the link remembers."""
LOOK_S: Final = 1.0
GARBLED: Final = (ValueError, IndexError, KeyError, TypeError, struct.error, MQTTException)
"""The errors that paho raises for bytes that are not MQTT."""

Taken = Callable[[str, bytes, bool], None]
"""A function that receives a message: its topic, its payload, and whether the message is retained. The
connection's thread calls the function."""


class Link(threading.Thread):
    """A connection. `up` is True while the link is connected and has subscribed to its topics.
    `failure` is the reason for the connection's end. While `connecting`, the thread may hang in the
    lookup of the broker's name, even after `close`.

    `refused` holds the broker's reason for each topic whose subscription the broker refused. When one
    of these attributes changes, the thread notifies `changed`. When the connection ends, the thread
    calls `on_end`.
    """

    def __init__(self, settings: MqttSettings, topics: Iterable[str], take: Taken) -> None:
        super().__init__(name="mqtt", daemon=True)
        self.changed = threading.Condition()
        self.up = False
        self.failure = ""
        self.refused: dict[str, str] = {}
        self.on_end: Callable[[], None] = lambda: None
        self._settings = settings
        self._topics = list(topics)
        self._take = take
        self.connecting = True
        self._closing = False
        self._acks: dict[int, str] = {}
        self._asked: dict[int, list[str]] = {}
        self._client = self._made()

    def run(self) -> None:
        """Connect, and serve the connection until its end."""
        failure = "the broker has closed the connection"
        if self._settings.client_id:
            failure += f": does another client have the id {self._settings.client_id}?"
        try:
            host, port = self._settings.address()
            self._client.connect(
                host, port, self._settings.keepalive_s, **_connect_options(self._v5)
            )
            self.connecting = False
            while not self._closing and self._client.loop(LOOK_S) == paho.MQTT_ERR_SUCCESS:
                pass
        except OSError as error:
            failure = self._explained(error)
        except GARBLED as error:
            failure = f"the server does not speak MQTT ({excerpt(str(error))}): is it a broker?"
        finally:
            self._ended(failure)

    def subscribe(self, topics: Iterable[str]) -> None:
        """Subscribe to more topics."""
        asked = list(topics)
        with self.changed:
            _, mid = self._client.subscribe([(topic, 0) for topic in asked])
            if mid is not None:
                self._asked[mid] = asked

    def publish(self, topic: str, payload: bytes, qos: int, expires_s: int | None) -> None:
        """Send a message. With `qos` 1, wait for the broker's confirmation. Raises HalError."""
        properties = None
        if self._v5 and expires_s is not None:
            properties = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
            properties.MessageExpiryInterval = expires_s
        info = self._client.publish(topic, payload, qos, retain=False, properties=properties)
        if info.rc != paho.MQTT_ERR_SUCCESS:
            raise HalError(f"{topic} was not sent: {paho.error_string(info.rc)}")
        if qos == 0:
            return
        with self.changed:
            timeout_s, acks = self._settings.timeout_s, self._acks
            if not self.changed.wait_for(lambda: info.mid in acks or self.failure, timeout_s):
                self.close(f"the broker does not confirm a message within {timeout_s:g} s")
            if (reason := acks.get(info.mid, self.failure)) != TAKEN:
                raise HalError(f"{topic}: {reason}")

    def close(self, failure: str = "closed") -> None:
        """End the connection, without waiting for its thread."""
        self._closing = True
        with self.changed:
            self.up, self.failure = False, self.failure or failure
        self._client.disconnect()

    @property
    def _v5(self) -> bool:
        return self._settings.version == "5"

    def _made(self) -> "BoundedClient":
        settings = self._settings
        client = BoundedClient(
            CallbackAPIVersion.VERSION2,
            client_id=settings.client_id or f"rmf-{os.urandom(6).hex()}",
            clean_session=None if self._v5 else True,
            protocol=paho.MQTTv5 if self._v5 else paho.MQTTv311,
            reconnect_on_failure=False,
        )
        client.connect_timeout = settings.timeout_s
        if settings.user:
            client.username_pw_set(settings.user, _password(settings.password_file))
        if settings.tls:
            client.tls_set_context(_tls(settings.tls))
        client.on_connect = self._on_connect
        client.on_subscribe = self._on_subscribe
        client.on_message = self._on_message
        client.on_publish = self._on_publish
        client.on_disconnect = self._on_disconnect
        client.on_socket_open = self._on_socket_open
        client.on_socket_register_write = _nothing  # only this thread may write to the socket
        return client

    def _on_socket_open(self, _c: Any, _u: Any, sock: Any) -> None:
        """Send each message at once. With Nagle's algorithm a command might wait 40 ms for an ACK.

        Send nothing if the link was closed while the broker's name was looked up. Otherwise the broker
        would end the next link, which has the same client's id.
        """
        if self._closing:
            raise ConnectionAbortedError
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _on_connect(self, _c: Any, _u: Any, flags: Any, reason: ReasonCode, _p: Any) -> None:
        if reason.is_failure:
            self._fail(
                f"the broker refuses the connection: {str(reason).lower()}: check user and"
                " password_file"
            )
        elif flags.session_present:
            self._fail(
                "the broker has kept an old session, although the daemon asked for a clean session"
            )
        elif self._topics:
            self.subscribe(self._topics)
        else:
            self._rise()

    def _on_subscribe(self, _c: Any, _u: Any, mid: int, reasons: Any, _p: Any) -> None:
        with self.changed:
            for topic, reason in zip(self._asked.pop(mid, []), reasons, strict=False):
                if reason.is_failure:
                    self.refused[topic] = str(reason).lower()
        self._rise()

    def _on_message(self, client: object, _: object, message: paho.MQTTMessage) -> None:
        if not self._closing:  # messages of a connection that is closing may be old
            self._take(message.topic, bytes(message.payload), message.retain)

    def _on_publish(self, _c: Any, _u: Any, mid: int, reason: ReasonCode, _p: Any) -> None:
        text = TAKEN
        if reason.value == NOBODY:
            text = "no device listens there: check its power, its network and the topic"
        elif reason.is_failure:
            text = f"the broker refuses the message: {str(reason).lower()}"
        with self.changed:
            if len(self._acks) >= ACKS_MAX:
                del self._acks[next(iter(self._acks))]
            self._acks[mid] = text
            self.changed.notify_all()

    def _on_disconnect(self, _c: Any, _u: Any, flags: Any, reason: ReasonCode, _p: Any) -> None:
        if flags.is_disconnect_packet_from_server:
            self._fail(f"the broker has ended the connection: {str(reason).lower()}")

    def _rise(self) -> None:
        with self.changed:
            self.up = not self.failure
            self.changed.notify_all()

    def _fail(self, failure: str) -> None:
        self._closing = True
        with self.changed:
            self.failure = self.failure or failure

    def _ended(self, failure: str) -> None:
        if cut := self._client.cut:
            failure = cut
        has_connected, self.connecting = not self.connecting, False
        with self.changed:
            self.up, self.failure = False, self.failure or failure
            self.changed.notify_all()
        if has_connected:
            self._client.disconnect()
            self._client.loop_write()
        if (sock := self._client.socket()) is not None:
            sock.close()  # close anyway, because a broker may never read DISCONNECT
        # The client closes the sockets that wake this thread only when nobody refers to it any more. So
        # it may not refer to the link, or both would wait for the garbage collector.
        client = self._client
        client.on_connect = client.on_subscribe = client.on_message = None
        client.on_publish = client.on_disconnect = client.on_socket_open = None
        self.on_end()

    def _explained(self, error: OSError) -> str:
        host, port = self._settings.address()
        if isinstance(error, ConnectionRefusedError):
            return f"{host}:{port} refuses the connection: is the broker running there?"
        if isinstance(error, socket.gaierror):
            return f"{host} is not known: check the name and the DNS server"
        if isinstance(error, ssl.SSLError):
            reason = getattr(error, "verify_message", None) or str(error)
            return f"TLS with {host}:{port} fails: {excerpt(reason)}: check tls and host"
        if isinstance(error, TimeoutError):
            return f"{host}:{port} does not answer: check power, cable and address"
        return f"{host}:{port} cannot be reached: {error.strerror or error}"


class BoundedClient(paho.Client):
    """A client that ends the connection before it reads a packet beyond PACKET_MAX.

    If this happens, `cut` holds the reason as text. The limit works because paho reads the rest of a
    packet with one call of `_sock_recv`.
    """

    cut = ""

    def _sock_recv(self, bufsize: int) -> bytes:
        if bufsize > PACKET_MAX:
            self.cut = f"the broker sent a message of {bufsize} bytes; the limit is {PAYLOAD_MAX}"
            raise ConnectionError(self.cut)
        return super()._sock_recv(bufsize)


def _connect_options(v5: bool) -> dict[str, Any]:
    if not v5:
        return {}
    properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
    properties.MaximumPacketSize = PACKET_MAX
    properties.SessionExpiryInterval = 0
    return {"clean_start": True, "properties": properties}


def _password(file: str | None) -> str | None:
    """Read the password. Each connection reads it again, because somebody may have renewed it. Raises
    HalError."""
    if file is None:
        return None
    try:
        return user_files.secret_line("password_file", file, "password")
    except user_files.SecretError as error:
        raise HalError(str(error)) from None


def _tls(settings: BrokerTls) -> ssl.SSLContext:
    """Read the certificates. Each connection reads them again. Raises HalError."""
    for file in (settings.ca_file, settings.certificate_file, settings.key_file):
        if file and not os.access(file, os.R_OK):
            raise HalError(f"tls: {file} cannot be read")
    try:
        context = ssl.create_default_context(cafile=settings.ca_file)
        if settings.certificate_file:
            context.load_cert_chain(settings.certificate_file, settings.key_file)
    except (OSError, ValueError) as error:
        raise HalError(f"tls: the certificates cannot be used: {excerpt(str(error))}") from None
    return context


def _nothing(client: object, _: object, sock: object) -> None:
    """Do nothing."""

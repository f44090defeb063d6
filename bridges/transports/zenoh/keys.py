"""The names that ROS's topics and nodes have on zenoh: the keys of samples, the liveliness tokens, and
the attachments of samples. The functions are pure.

There are two naming schemes. Nodes with different schemes do not hear each other.

- The scheme of rmw_zenoh, in which each ROS context is a zenoh session. Source: ros2/rmw_zenoh, jazzy:
  its design.md; rmw_zenoh_cpp/src/detail/liveliness_utils.cpp and attachment_helpers.cpp.
- The scheme of zenoh-bridge-ros2dds, which connects a DDS domain with zenoh. Source:
  eclipse-zenoh/zenoh-plugin-ros2dds, liveliness_mgt.rs and ros2_utils.rs.

A liveliness token is a key that exists as long as its session. Tokens announce a node, a publisher or a
subscription to other nodes. An end is a publisher or a subscription.
"""

import re
import struct
from typing import Final, Literal, Protocol

import xxhash
from msgspec import Struct

from bridges.messages.definitions import PACKAGES
from bridges.messages.releases import NEWEST, Release
from bridges.messages.rihs01 import type_hash
from bridges.messages.topics import AnyTopic, Qos
from bridges.transports.peers import WITNESSES, Announced

Kind = Literal["MP", "MS"]
"""A publisher (MP, message publisher) or a subscription (MS, message subscription), as rmw_zenoh
abbreviates them."""
NODE_ID: Final = 0
_HEAD: Final = struct.Struct("<qqB")
GID_LENGTH: Final = 16
LONGEST: Final = 2000
"""The maximum length (characters) of a ROS node's token. ROS limits each name in a token to 255
characters."""
HASH: Final = re.compile(r"typehash=(RIHS01_[0-9a-f]{64});")


class Peer(Struct, frozen=True):
    """A publisher or subscription of another node, as its token announces it.

    - `type`: the message type, with the hash if the token has a hash
    - `transient_local`: Does the publisher retain messages, or does the subscription want retained
      messages?
    - `announced`: the end's topic, type and hash
    - `node`: the end's node, as `/namespace/name`
    """

    session: str
    type: str
    transient_local: bool
    announced: Announced
    node: str


class Keys(Protocol):
    """The keys and tokens of one node, in one of the two naming schemes. `session`: the id of the zenoh
    session."""

    session: str
    release: Release

    def presence(self) -> str:
        """Return the token of the node itself."""

    def data(self, topic: AnyTopic) -> str:
        """Return the key of a topic's samples."""

    def type(self, topic: AnyTopic) -> str:
        """Return the topic's type, in the form of `Peer.type`."""

    def token(self, kind: Kind, topic: AnyTopic, number: int) -> str:
        """Return the token that announces a publisher or subscription. `kind` says which of the two.
        `number` is unique in the session."""

    def others(self, kind: Kind, topic: AnyTopic) -> str:
        """Return a key expression for a topic. It matches the tokens of all publishers or of all
        subscriptions, as `kind` says."""

    def witnesses(self) -> list[str]:
        """Return key expressions for the tokens that show RMF's release. Only RMF's own nodes have such
        tokens (`peers.py`)."""

    def peer(self, token: str) -> Peer | None:
        """Return the publisher or subscription that a token announces. Return None for any other
        token."""


class RmwZenoh:
    """rmw_zenoh's keys for a node in a ROS domain. In a token, `%` replaces a name's slashes."""

    def __init__(
        self, domain_id: int, session: str, node_name: str, release: Release = NEWEST
    ) -> None:
        self.session, self.release = session, release
        self._domain = domain_id
        self._node = f"%/%/{node_name}"  # enclave "/", namespace "/"

    def presence(self) -> str:
        return f"@ros2_lv/{self._domain}/{self.session}/{NODE_ID}/{NODE_ID}/NN/{self._node}"

    def data(self, topic: AnyTopic) -> str:
        return f"{self._domain}/{topic.name.strip('/')}/{self.type(topic)}"

    def type(self, topic: AnyTopic) -> str:
        name = f"{PACKAGES[topic.type]}::msg::dds_::{topic.type.__name__}_"
        return f"{name}/{type_hash(topic.type, self.release)}"

    def token(self, kind: Kind, topic: AnyTopic, number: int) -> str:
        qos = _qos(topic, kind)
        ids = f"{self._domain}/{self.session}/{NODE_ID}/{number}/{kind}"
        retained = "1" if qos.durability == "transient_local" else ""
        # rmw_zenoh leaves out its defaults, which are reliable, volatile and keep last 42.
        depth = "" if qos.depth == 42 else qos.depth
        return (
            f"@ros2_lv/{ids}/{self._node}/{_name(topic, '%')}/{self.type(topic)}"
            f"/:{retained}:,{depth}:,:,:,,"
        )

    def others(self, kind: Kind, topic: AnyTopic) -> str:
        return f"@ros2_lv/{self._domain}/*/*/*/{kind}/*/*/*/{_name(topic, '%')}/**"

    def witnesses(self) -> list[str]:
        return [
            f"@ros2_lv/{self._domain}/*/*/*/{_kind(publishes)}/*/*/*/*/{package}::msg::dds_::{name}_/**"
            for package, name, publishes in _witnesses()
        ]

    def peer(self, token: str) -> Peer | None:
        parts = token.split("/") if len(token) <= LONGEST else []
        qos = parts[12].split(":") if len(parts) > 12 else []
        if len(qos) < 6:
            return None
        kind = parts[10].replace("::msg::dds_::", "/msg/").removesuffix("_")
        topic = parts[9].strip("%").replace("%", "/")
        announced = Announced(topic, kind, parts[11], parts[5] == "MP")
        node = f"{parts[7].replace('%', '/').rstrip('/')}/{parts[8]}"
        return Peer(parts[2], "/".join(parts[10:12]), qos[1] == "1", announced, node)


class Ros2Dds:
    """The keys of zenoh-bridge-ros2dds. In a token, `§` replaces a name's slashes.

    A key does not name the ROS domain, because a bridge serves only one domain. A key does not name the
    type, because the token names it.
    """

    def __init__(
        self, domain_id: int, session: str, node_name: str, release: Release = NEWEST
    ) -> None:
        self.session, self.release = session, release

    def presence(self) -> str:
        return f"@/{self.session}/@ros2_lv"

    def data(self, topic: AnyTopic) -> str:
        return topic.name.strip("/")

    def type(self, topic: AnyTopic) -> str:
        return f"{PACKAGES[topic.type]}§msg§{topic.type.__name__}"

    def token(self, kind: Kind, topic: AnyTopic, number: int) -> str:
        qos = _qos(topic, kind)
        retained = int(qos.durability == "transient_local")
        # The parts: no key fields; reliable; durability; keep last; user data of the bridge's DDS
        # endpoint.
        text = f":1:{retained}:0,{qos.depth}:typehash={type_hash(topic.type, self.release)};"
        return f"@/{self.session}/@ros2_lv/{kind}/{_name(topic, '§')[1:]}/{self.type(topic)}/{text}"

    def others(self, kind: Kind, topic: AnyTopic) -> str:
        return f"@/*/@ros2_lv/{kind}/{_name(topic, '§')[1:]}/*/*"

    def witnesses(self) -> list[str]:
        return [
            f"@/*/@ros2_lv/{_kind(publishes)}/*/{package}§msg§{name}/*"
            for package, name, publishes in _witnesses()
        ]

    def peer(self, token: str) -> Peer | None:
        parts = token.split("/") if len(token) <= LONGEST else []
        qos = parts[6].split(":") if len(parts) > 6 else []
        if len(qos) < 4:
            return None
        found = HASH.search(parts[6])
        topic, kind = parts[4].replace("§", "/"), parts[5].replace("§", "/")
        announced = Announced(topic, kind, found[1] if found else "", parts[3] == "MP")
        node = f"a node behind the zenoh bridge {parts[1]}"
        return Peer(parts[1], parts[5], qos[2] == "1", announced, node)


WAYS: Final[dict[str, type[RmwZenoh] | type[Ros2Dds]]] = {
    "rmw_zenoh": RmwZenoh,
    "ros2dds": Ros2Dds,
}


def gid(token: str) -> bytes:
    """Return the 16 bytes (gid) by which ROS identifies a publisher or subscription. They are the
    XXH3-128 hash of its token, with the lower half first."""
    return xxhash.xxh3_128_digest(token.encode())[::-1]


def attachment(number: int, wall_ns: int, sender: bytes) -> bytes:
    """Return the attachment that a publisher adds to a sample.

    - `number`: the number of this sample among the publisher's samples, from 1
    - `wall_ns`: the time of sending (ns since the epoch)
    - `sender`: the gid of the publisher
    """
    return _HEAD.pack(number, wall_ns, GID_LENGTH) + sender


def sender(attached: bytes) -> bytes | None:
    """Return the gid of the publisher in an attachment. Return None for an attachment that no ROS node
    has made."""
    if len(attached) != _HEAD.size + GID_LENGTH or attached[_HEAD.size - 1] != GID_LENGTH:
        return None
    return attached[_HEAD.size :]


def _kind(publishes: bool) -> Kind:
    return "MP" if publishes else "MS"


def _witnesses() -> list[tuple[str, str, bool]]:
    split = ((*name.partition("/msg/"), publishes) for name, publishes in sorted(WITNESSES))
    return [(package, name, publishes) for package, _, name, publishes in split]


def _qos(topic: AnyTopic, kind: Kind) -> Qos:
    return topic.publish if kind == "MP" else topic.subscribe


def _name(topic: AnyTopic, slash: str) -> str:
    return f"/{topic.name.strip('/')}".replace("/", slash)

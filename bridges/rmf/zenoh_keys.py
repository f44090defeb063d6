"""How ROS's topics and nodes are named on zenoh: data keys, liveliness tokens, attachments. Pure.

Two ways, which do not understand each other: rmw_zenoh's, where each context of ROS is a zenoh session
(ros2/rmw_zenoh, jazzy: docs/design.md; rmw_zenoh_cpp/src/detail/liveliness_utils.cpp and
attachment_helpers.cpp), and zenoh-bridge-ros2dds's, which routes a DDS domain
(eclipse-zenoh/zenoh-plugin-ros2dds: liveliness_mgt.rs, ros2_utils.rs).

A token is a key that lives as long as its session: by it the others know of a node and its ends.
"""

import re
import struct
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol

import xxhash

from bridges.rmf.definitions import PACKAGES
from bridges.rmf.peers import WITNESSES, Announced
from bridges.rmf.releases import NEWEST, Release
from bridges.rmf.rihs01 import type_hash
from bridges.rmf.topics import Qos, Topic

Kind = Literal["MP", "MS"]
"""A publisher or a subscription: rmw_zenoh's Message Publisher and Message Subscription."""
NODE_ID: Final = 0
_HEAD: Final = struct.Struct("<qqB")
GID_LENGTH: Final = 16
HASH: Final = re.compile(r"typehash=(RIHS01_[0-9a-f]{64});")


@dataclass(frozen=True, slots=True)
class End:
    """What a token says of a publisher or subscription: its session, its type (as the keys name it),
    whether it retains messages or wants what is retained, and all that its node announces of it."""

    session: str
    type: str
    transient_local: bool
    announced: Announced


class Keys(Protocol):
    """One of the two ways, for one node."""

    session: str
    release: Release

    def presence(self) -> str:
        """The token of the node itself."""

    def data(self, topic: Topic[Any]) -> str:
        """The key under which a topic's samples travel."""

    def type(self, topic: Topic[Any]) -> str:
        """The topic's type as `End.type` names it."""

    def token(self, kind: Kind, topic: Topic[Any], number: int) -> str:
        """The token of one end; `number` is its own within the session."""

    def others(self, kind: Kind, topic: Topic[Any]) -> str:
        """Matches the token of each end of this kind on a topic."""

    def witnesses(self) -> list[str]:
        """Matches the tokens that tell RMF's release (`peers.py`)."""

    def end(self, token: str) -> End | None:
        """The end that a token describes; None for any other token."""


class RmwZenoh:
    """rmw_zenoh's keys for a node in a ROS domain. A slash within a part of a token is `%`."""

    def __init__(
        self, domain_id: int, session: str, node_name: str, release: Release = NEWEST
    ) -> None:
        self.session, self.release = session, release
        self._domain = domain_id
        self._node = f"%/%/{node_name}"  # enclave "/", namespace "/"

    def presence(self) -> str:
        return f"@ros2_lv/{self._domain}/{self.session}/{NODE_ID}/{NODE_ID}/NN/{self._node}"

    def data(self, topic: Topic[Any]) -> str:
        return f"{self._domain}/{topic.name.strip('/')}/{self.type(topic)}"

    def type(self, topic: Topic[Any]) -> str:
        name = f"{PACKAGES[topic.type]}::msg::dds_::{topic.type.__name__}_"
        return f"{name}/{type_hash(topic.type, self.release)}"

    def token(self, kind: Kind, topic: Topic[Any], number: int) -> str:
        qos = _qos(topic, kind)
        ids = f"{self._domain}/{self.session}/{NODE_ID}/{number}/{kind}"
        retained = "1" if qos.durability == "transient_local" else ""
        # Only what differs from rmw_zenoh's own defaults is written: reliable, volatile, keep last 42.
        depth = "" if qos.depth == 42 else qos.depth
        return (
            f"@ros2_lv/{ids}/{self._node}/{_name(topic, '%')}/{self.type(topic)}"
            f"/:{retained}:,{depth}:,:,:,,"
        )

    def others(self, kind: Kind, topic: Topic[Any]) -> str:
        return f"@ros2_lv/{self._domain}/*/*/*/{kind}/*/*/*/{_name(topic, '%')}/**"

    def witnesses(self) -> list[str]:
        return [
            f"@ros2_lv/{self._domain}/*/*/*/{_kind(publishes)}/*/*/*/*/{package}::msg::dds_::{name}_/**"
            for package, name, publishes in _witnesses()
        ]

    def end(self, token: str) -> End | None:
        parts = token.split("/")
        qos = parts[12].split(":") if len(parts) > 12 else []
        if len(qos) < 6:
            return None
        kind = parts[10].replace("::msg::dds_::", "/msg/").removesuffix("_")
        topic = parts[9].strip("%").replace("%", "/")
        announced = Announced(topic, kind, parts[11], parts[5] == "MP")
        return End(parts[2], "/".join(parts[10:12]), qos[1] == "1", announced)


class Ros2Dds:
    """zenoh-bridge-ros2dds's keys. A slash within a part of a token is `§`.

    A key holds neither domain nor type: the bridge stands for one domain, and a token says the type.
    """

    def __init__(
        self, domain_id: int, session: str, node_name: str, release: Release = NEWEST
    ) -> None:
        self.session, self.release = session, release

    def presence(self) -> str:
        return f"@/{self.session}/@ros2_lv"

    def data(self, topic: Topic[Any]) -> str:
        return topic.name.strip("/")

    def type(self, topic: Topic[Any]) -> str:
        return f"{PACKAGES[topic.type]}§msg§{topic.type.__name__}"

    def token(self, kind: Kind, topic: Topic[Any], number: int) -> str:
        qos = _qos(topic, kind)
        retained = int(qos.durability == "transient_local")
        # No key fields; reliable; durability; keep last; the user data of the DDS end made for us.
        text = f":1:{retained}:0,{qos.depth}:typehash={type_hash(topic.type, self.release)};"
        return f"@/{self.session}/@ros2_lv/{kind}/{_name(topic, '§')[1:]}/{self.type(topic)}/{text}"

    def others(self, kind: Kind, topic: Topic[Any]) -> str:
        return f"@/*/@ros2_lv/{kind}/{_name(topic, '§')[1:]}/*/*"

    def witnesses(self) -> list[str]:
        return [
            f"@/*/@ros2_lv/{_kind(publishes)}/*/{package}§msg§{name}/*"
            for package, name, publishes in _witnesses()
        ]

    def end(self, token: str) -> End | None:
        parts = token.split("/")
        qos = parts[6].split(":") if len(parts) > 6 else []
        if len(qos) < 4:
            return None
        found = HASH.search(parts[6])
        topic, kind = parts[4].replace("§", "/"), parts[5].replace("§", "/")
        announced = Announced(topic, kind, found[1] if found else "", parts[3] == "MP")
        return End(parts[1], parts[5], qos[2] == "1", announced)


WAYS: Final[dict[str, type[RmwZenoh] | type[Ros2Dds]]] = {
    "rmw_zenoh": RmwZenoh,
    "ros2dds": Ros2Dds,
}


def gid(token: str) -> bytes:
    """The 16 bytes that name an end to ROS: the token's XXH3-128, its lower half first."""
    return xxhash.xxh3_128_digest(token.encode())[::-1]


def attachment(number: int, wall_ns: int, sender: bytes) -> bytes:
    """What goes along with a sample: its number (from 1), when it was sent, and its sender's gid."""
    return _HEAD.pack(number, wall_ns, GID_LENGTH) + sender


def sender(attached: bytes) -> bytes | None:
    """The gid in an attachment; None if it is not a ROS node's attachment."""
    if len(attached) != _HEAD.size + GID_LENGTH or attached[_HEAD.size - 1] != GID_LENGTH:
        return None
    return attached[_HEAD.size :]


def _kind(publishes: bool) -> Kind:
    return "MP" if publishes else "MS"


def _witnesses() -> list[tuple[str, str, bool]]:
    return [(*name.split("/msg/"), publishes) for name, publishes in sorted(WITNESSES)]  # type: ignore[misc]


def _qos(topic: Topic[Any], kind: Kind) -> Qos:
    return topic.publish if kind == "MP" else topic.subscribe


def _name(topic: Topic[Any], slash: str) -> str:
    return f"/{topic.name.strip('/')}".replace("/", slash)

"""The releases of RMF's message packages, and the parts of `definitions.py` that each release lacks.

The source is open-rmf/rmf_internal_msgs. Every line of the messages in these releases was compared.

- jazzy: 3.3.1 (a351d51602383eb09a8138d302827a76241630a5), branch jazzy at
  04585f0e2b0da9f11327fb403d38bc547d648fa6. Humble's 3.0.4 and Iron's 3.1.3 are the same.
- kilted: 3.5.0 (branch kilted at c0f72ce5e2129411d2868414b25f6fab1460fcdb). Lyrical's 4.1.0
  (3d4df023bacaf7a091564e98f4aff0776f72a612) is the same.

If a message type differs between two releases, nodes of these releases do not hear each other on topics
of that type. Each node announces a type hash with every endpoint. So these hashes show the release of
RMF on a graph.
"""

from typing import Final

from msgspec import Struct

from bridges.messages.definitions import (
    PACKAGES,
    Alert,
    AlertParameter,
    EmergencySignal,
    RobotMode,
    field_types,
)


class Release(Struct, frozen=True, eq=False):
    """One release. `lacks`: the messages that the release does not have. `without`: pairs of a message
    and a field. In this release the message does not have the field."""

    name: str
    lacks: frozenset[type] = frozenset()
    without: frozenset[tuple[type, str]] = frozenset()

    def has(self, message_type: type) -> bool:
        """Return whether the release has this message."""
        return message_type not in self.lacks

    def fields(self, message_type: type) -> dict[str, type]:
        """Return the annotation of each field, in the message's order. Leave out the fields that this
        release lacks."""
        return {
            name: kind
            for name, kind in field_types(message_type).items()
            if (message_type, name) not in self.without
        }

    def messages(self) -> list[type]:
        """List the messages of the release."""
        return [kind for kind in PACKAGES if self.has(kind)]


JAZZY: Final = Release(
    "jazzy",
    lacks=frozenset({EmergencySignal, Alert, AlertParameter}),
    without=frozenset({(RobotMode, "performing_action")}),
)
KILTED: Final = Release("kilted")
RELEASES: Final = {release.name: release for release in (JAZZY, KILTED)}
DEFAULT: Final = JAZZY
"""The release of most sites. The daemon uses it until a fleet adapter shows another release."""
DIFFERING: Final = frozenset[type]().union(
    *(release.lacks | {message for message, _ in release.without} for release in RELEASES.values())
)
"""The messages that are not the same in all releases."""
NEWEST: Final = KILTED
"""The only release that has all messages and all fields."""

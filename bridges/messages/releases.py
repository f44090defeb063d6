"""The releases of RMF's message packages, and what of `definitions.py` each of them lacks.

Read in open-rmf/rmf_internal_msgs, every line of the messages in `definitions.py`:
- jazzy: 3.3.1 (a351d51602383eb09a8138d302827a76241630a5), branch jazzy at
  04585f0e2b0da9f11327fb403d38bc547d648fa6. Humble's 3.0.4 and Iron's 3.1.3 are the same.
- kilted: 3.5.0 (branch kilted at c0f72ce5e2129411d2868414b25f6fab1460fcdb). Lyrical's 4.1.0
  (3d4df023bacaf7a091564e98f4aff0776f72a612) is the same.

Two nodes of different releases do not hear each other where a message differs. Each announces the type
hash of every end, so the hashes on a graph tell which release RMF has there.
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
    """One release. `lacks`: messages that it does not have; `without`: fields, as (message, field)."""

    name: str
    lacks: frozenset[type] = frozenset()
    without: frozenset[tuple[type, str]] = frozenset()

    def has(self, message_type: type) -> bool:
        """Does it have this message?"""
        return message_type not in self.lacks

    def fields(self, message_type: type) -> dict[str, type]:
        """Field -> type, in the message's order in this release."""
        return {
            name: kind
            for name, kind in field_types(message_type).items()
            if (message_type, name) not in self.without
        }

    def messages(self) -> list[type]:
        """Every message that it has."""
        return [kind for kind in PACKAGES if self.has(kind)]


JAZZY: Final = Release(
    "jazzy",
    lacks=frozenset({EmergencySignal, Alert, AlertParameter}),
    without=frozenset({(RobotMode, "performing_action")}),
)
KILTED: Final = Release("kilted")
RELEASES: Final = {release.name: release for release in (JAZZY, KILTED)}
DEFAULT: Final = JAZZY
"""The release to speak while no fleet adapter shows one: most sites have it."""
DIFFERING: Final = frozenset[type]().union(
    *(release.lacks | {message for message, _ in release.without} for release in RELEASES.values())
)
"""The messages that differ between releases."""
NEWEST: Final = KILTED
"""The release that has every message and field."""

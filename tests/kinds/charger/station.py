"""The beginning of stories about a station that recognises the robot on its pad. The core can switch
the station's power."""

from msgspec.structs import replace

from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.signals import Activity as A
from tests.kinds.charger.story import (
    AMR1,
    FULL,
    Story,
)

SERVING = replace(FULL, unrequested="serve_known")


def still_charging(it: Story) -> list[str]:
    return [fault for fault in it.faults if fault.startswith("STILL_CHARGING")]


ONE, TWO, NOBODY = "rx-1", "rx-2", ""


def story(limits: ChargerLimits = FULL) -> Story:
    return Story(limits).sees((A.IDLE, NOBODY, 1))


def docked() -> Story:
    """Return a story at 5 s. AMR01 sent its request at 1 s, then docked, and has charged since 4 s."""
    return (
        story().event(AMR1).sees((A.IDLE, NOBODY, 2), (A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1))
    )

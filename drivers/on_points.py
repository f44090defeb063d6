"""The common part of all drivers for devices with contacts and relays. Each driver adds `read` and
`write`."""

from collections.abc import Mapping

from drivers.hal.points import Points, Readings


class OnPoints:
    """A device's contacts and relays."""

    def __init__(self, points: Points) -> None:
        self._points = points

    def take_inputs(self, elsewhere: Readings) -> None:
        """Give the driver the function `elsewhere`. The driver calls it to read the contacts that are
        on other buses."""
        self._points.take_inputs(elsewhere)

    def open(self) -> None:
        """Claim every relay and every contact. The claim leaves all relays off."""
        self._points.open()

    def contacts(self) -> Mapping[str, bool]:
        """Return each contact's last reading and each relay's last written value."""
        return self._points.last_known()

    def make_safe(self) -> None:
        """Switch every relay off. Read each relay back where the hardware allows this."""
        self._points.make_safe()

    def close(self) -> None:
        """Switch every relay off and release the lines."""
        self._points.close()

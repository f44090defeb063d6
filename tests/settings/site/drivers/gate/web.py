"""A driver without wires."""

from bridges.kinds.shared.fields import DeviceSettings, Name
from drivers import Driver
from drivers.driver_type import DriverType
from tests.settings.site.hal import web


class Settings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of a gate behind a web server."""

    page: Name = "gate"


def describe(settings: Settings, bus: web.Settings) -> list[tuple[str, str]]:
    """Return the addresses that the driver uses."""
    return [("polls", f"http://{bus.host}/{settings.page}"), ("identity", "not verified")]


def create(name: str, settings: Settings, bus: object) -> Driver[None, None]:
    """Create nothing: no test runs this driver."""
    raise NotImplementedError


DRIVER = DriverType(settings=Settings, buses=("web",), create=create, describe=describe)

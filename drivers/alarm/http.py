"""An alarm panel behind a controller that speaks HTTP and JSON. Each source is a field of one answer.

A field has no cable of its own. If the loop behind a field is cut, only the controller can notice the
cut.
"""

from collections.abc import Iterator
from typing import Annotated

from msgspec import Meta

from bridges.kinds.alarm.settings import PanelSettings
from bridges.kinds.alarm.signals import PanelOutputs, PanelSample
from bridges.kinds.shared.alarming import alarm_notes
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers import json_fields
from drivers.alarm.sources import PURPOSE, drill_problems
from drivers.driver_type import DriverType
from drivers.hal import http
from drivers.http_call import InsistentCalls
from drivers.json_fields import JsonFlag


class HttpPanelSettings(PanelSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A panel and its controller. Every path is relative to the bus's `api_base`."""

    state_path: Annotated[http.Path, tells("the path that GET reads the sources from.")]
    sources: Annotated[
        dict[Name, JsonFlag],
        Meta(min_length=1),
        tells("the field of each source of the alarm, by a name that the site chooses."),
    ]
    drill: Annotated[JsonFlag | None, tells("the field that begins a drill of `drill_s`.")] = None

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        yield from drill_problems(self, self.sources, self.drill is not None)


def describe(settings: HttpPanelSettings, bus: http.HttpSettings) -> Iterator[tuple[str, str]]:
    """Yield rows for `check`. The first row is about the request that reads the panel. Each other row
    is about a source's field."""
    api = http.base(bus.api_base)
    yield "state", f"GET {api.url(settings.state_path)} every {bus.scan_s:g} s"
    for name, place in settings.sources.items():
        yield name, json_fields.place_text(place)
    if settings.drill:
        yield "drill", json_fields.place_text(settings.drill)
    yield PURPOSE


class HttpPanel:
    """The driver of one panel (`drivers.Driver`)."""

    def __init__(self, settings: HttpPanelSettings, bus: InsistentCalls) -> None:
        self._settings = settings
        self._bus = bus

    def open(self) -> None:
        """Check that the controller's answer has every source. Raises DriverError."""
        self.read()

    def read(self) -> PanelSample:
        """Read every source now. Raises DriverError."""
        answer = self._bus.get_json(self._settings.state_path)
        places = self._settings.sources.items()
        sources = {name: json_fields.certain(answer, at) for name, at in places}
        return PanelSample(sources, json_fields.flag_if(answer, self._settings.drill))

    def write(self, outputs: PanelOutputs) -> None:
        """Do nothing, because a panel is only read."""

    def make_safe(self) -> None:
        """Do nothing, because there is no output."""

    def close(self) -> None:
        """Do nothing, because the bus closes its connection."""


DRIVER = DriverType(
    settings=HttpPanelSettings,
    buses=("http",),
    create=lambda name, settings, bus: HttpPanel(settings, bus),
    describe=describe,
    notes=alarm_notes,
    fake="hal_fakes.http_alarm",
)

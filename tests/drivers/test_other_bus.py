"""Drivers whose inputs are contacts on a second bus.

Such a driver reads the same sample as on a single bus. If the second bus fails, the driver reads no
sample.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from bridges.settings.load import Config, load
from drivers import DriverError, TakesInputs
from drivers.hal.points import Points
from hal_fakes.fake import plants_on
from tests.drivers.far import PointsFar

CONFIG: Final = Path(__file__).parents[2] / "config"
PATHS: Final = sorted(CONFIG.glob("*.yaml"))
BESIDE: Final = {
    "gpio": {"type": "gpio", "chip": 9},
    "modbus": {"type": "modbus", "tcp": {"host": "127.0.0.9"}},
}
DRIVEN: Final = ("outputs", "calls", "call_code")


def on_contacts() -> Iterator[str]:
    """Yield the names of the example files whose only bus has the inputs as contacts."""
    for path in PATHS:
        content = yaml.safe_load(path.read_text())
        if content.get("driver") == "dry_contact" and len(content["buses"]) == 1:
            yield path.name


class Now:
    now = 1.0


def moved(part: Any) -> None:
    """Put each input in this part of a YAML file onto the bus `other`."""
    if isinstance(part, dict):
        if "point" in part:
            part["bus"] = "other"
        for name, below in part.items():
            if name not in DRIVEN:
                moved(below)
    for item in part if isinstance(part, list) else ():
        moved(item)


def split(name: str, folder: Path) -> Config:
    """Load this example file with every input on a second bus of the same type."""
    content = yaml.safe_load((CONFIG / name).read_text())
    (own,) = content["buses"]
    settings = content["buses"][own]
    content["buses"]["other"] = BESIDE.get(settings["type"], {**settings, "host": "192.168.1.11"})
    key = next(key for key in content if key not in ("kind", "driver", "rmf", "buses", "recording"))
    for device in content[key].values():
        moved(device)
        device["bus"] = own
    file = folder / name
    file.write_text(yaml.safe_dump(content, sort_keys=False))
    return load(file)


@pytest.mark.parametrize("name", list(on_contacts()))
def test_the_sample_is_the_same_whichever_bus_has_the_inputs(name: str, tmp_path: Path) -> None:
    whole, parts = load(CONFIG / name), split(name, tmp_path)
    for device, settings in parts.devices.items():
        own = parts.bus_of(device)
        assert parts.other_buses(device) == ["other"]
        plant = plants_on(whole, own)[device]
        far = PointsFar(Now(), plant, whole.wires(device))
        wanted = whole.driver_type(device).create(device, whole.devices[device], far)
        here = PointsFar(Now(), plant, parts.wires_on(own, device))
        driver = parts.driver_type(device).create(device, settings, here)
        assert isinstance(driver, TakesInputs)
        with pytest.raises(DriverError, match="no function to read"):
            driver.read()
        wires = parts.wires_on("other", device)
        there = PointsFar(Now(), plant, wires)
        driver.take_inputs(Points(wires, there).read)
        assert driver.read() == wanted.read()
        there.down = "the other bus is gone"
        with pytest.raises(DriverError, match="the other bus is gone"):
            driver.read()


def test_no_file_of_a_kind_on_contacts_is_left_out() -> None:
    kinds = {load(CONFIG / name).kind for name in on_contacts()}
    assert kinds >= {"lift", "door", "charger", "alarm", "dispenser"}

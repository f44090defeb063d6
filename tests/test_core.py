"""The imports of the core, the modules that every installation has. The core imports no extra module.
It imports only the libraries that every installation has (decision 0123)."""

import sys
import tomllib
from functools import cache
from pathlib import Path

import grimp
import pytest
from packaging.requirements import Requirement

from bridges.settings import names

ROOT = Path(__file__).parents[1]
DEVICES = ("lift", "door", "charger")
BUSES = ("can", "gpio", "http", "modbus")
PACKAGES = (
    "bridges", "bridges.commands", "bridges.kinds", "bridges.transports", "drivers", "drivers.hal",
)  # fmt: skip
"""The packages that contain the core. INSIDE lists which modules of each package belong to the core."""
INSIDE = {
    "bridges": "blackbox cli exit_codes messages observe runtime settings system yaml",
    "bridges.commands": "backup check completion disable enable incident log migrate outputs_off"
    " recorder reset run status",
    "bridges.kinds": "lift door charger lift_supervisor door_supervisor charger_coordinator shared",
    "bridges.transports": "dds ros2 zenoh"
    " addresses choose cyclone notices peers repeats senders threaded transport",
    "drivers": "lift door charger profiles"
    " driver_type http_call json_fields numbers on_points tables unsafe",
    "drivers.hal": "can gpio http modbus"
    " backoff deadline every hosts http_address http_json http_login http_settings points rivals"
    " serial_port unit_calls",
}
CORE = [f"{package}.{name}" for package, listed in INSIDE.items() for name in listed.split()]
"""The modules and whole folders of the core. Exception: a driver in these folders is no part of the
core if all of its buses are extras."""
LIBRARIES = {
    "argcomplete": "argcomplete", "can": "python-can", "canopen": "canopen", "cantools": "cantools",
    "cyclonedds": "cyclonedds", "gpiozero": "gpiozero", "lgpio": "lgpio", "mcap": "mcap",
    "msgspec": "msgspec", "pymodbus": "pymodbus", "requests": "requests", "serial": "pyserial",
    "urllib3": "requests", "xxhash": "xxhash", "yaml": "PyYAML", "zenoh": "eclipse-zenoh",
}  # fmt: skip
"""For each imported module, the PyPI name of its library. The core may import only these modules."""
FLEET = ("bridges.runtime.fleet", "bridges.settings.fleet_site", "bridges.settings.nav_graph")
"""Modules for fleets of robots. These modules are extras, although they lie in the core's folders."""
ON_REQUEST = {
    ("drivers.hal.http", "drivers.hal.http_push"),
    ("bridges.runtime.service", "bridges.runtime.fleet.service"),
    ("bridges.commands.run", "bridges.settings.fleet_site"),
    ("bridges.commands.check", "bridges.settings.fleet_site"),
    ("bridges.commands.enable", "bridges.settings.fleet_site"),
}
"""The permitted imports of extras by the core, as (core module, extra module). Each import runs only if
a YAML needs the extra."""
OF_ROS = {"rclpy", "launch", "launch_ros", "_typeshed"}


@cache
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("bridges", "drivers", include_external_packages=True)


@cache
def extra_drivers() -> set[str]:
    """Return the drivers in the core's folders that know only the buses of extras."""
    return {
        f"drivers.{kind}.{name}"
        for kind in DEVICES
        for name in names.driver_names(kind)
        if not set(BUSES) & set(names.driver_called(kind, name).buses)
    }


def is_core(module: str) -> bool:
    """Return whether the module belongs to the core."""
    listed = any(module == one or module.startswith(f"{one}.") for one in CORE)
    listed = listed and not any(module == one or module.startswith(f"{one}.") for one in FLEET)
    return module in PACKAGES or (listed and module not in extra_drivers())


def core() -> list[str]:
    ours = [m for m in graph().modules if m.split(".")[0] in ("bridges", "drivers")]
    return sorted(filter(is_core, ours))


def is_ours(module: str) -> bool:
    return module.split(".")[0] in ("bridges", "drivers")


def test_the_core_imports_no_extra() -> None:
    wrong = [
        f"{module} imports {imported}"
        for module in core()
        for imported in sorted(graph().find_modules_directly_imported_by(module))
        if is_ours(imported) and not is_core(imported) and (module, imported) not in ON_REQUEST
    ]
    assert wrong == []


def test_the_core_needs_no_library_but_those_that_every_installation_has() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    needs = [*project["dependencies"], *extras["gpio"], *extras["recording"]]
    brought = {Requirement(need).name for need in needs}
    imported = {
        name
        for module in core()
        for name in graph().find_modules_directly_imported_by(module)
        if not is_ours(name) and name not in sys.stdlib_module_names
    }
    assert imported - OF_ROS - set(LIBRARIES) == set()
    assert {LIBRARIES[name] for name in imported - OF_ROS} - brought == set()


def test_every_entry_of_the_core_exists() -> None:
    assert [one for one in CORE if one not in graph().modules] == []


@pytest.mark.parametrize(
    "module",
    [
        "drivers.hal.mqtt",
        "drivers.hal.mqtt.client",
        "bridges.kinds.workcell",
        "bridges.fleet.adapter",
        "bridges.commands.fleet",
        "bridges.transports.mqtt",
        "workbench.page.web",
    ],
)
def test_whatever_is_not_listed_is_an_extra(module: str) -> None:
    assert not is_core(module)

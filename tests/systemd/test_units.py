"""systemd itself checks the unit with the drop-in of each shipped file."""

import configparser
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from bridges.runtime.drop_in import text
from bridges.settings.load import load
from bridges.system.directories import GROUPS
from workbench.commissioning.examples import device_yamls

ROOT = Path(__file__).parents[2]
FILES = ROOT / "systemd"
UNIT = FILES / "rmf-bridge@.service"
RECORDER = FILES / "rmf-bridge-recorder.service"
PAGE = FILES / "rmf-bridge-page.service"
EARLY = FILES / "rmf-bridge-outputs-off.service"
EXPORTER = FILES / "rmf-bridge-exporter.service"
NOTIFY = FILES / "rmf-bridge-notify.service"
OTHERS = (RECORDER, PAGE, EXPORTER, NOTIFY, EARLY)
CONFIG = device_yamls()
VERIFY = ("systemd-analyze", "verify", "--man=no")
MOST = 2.0
"""The highest permitted exposure score of a service. On systemd 252 a service on the network scores
1.5. A service with GPIO or a serial port scores 1.7. A service with CAN sockets scores 1.7 too,
because AF_CAN counts as exotic (0.2)."""

needs_systemd = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed"
)


def system(folder: Path, file: Path) -> str:
    """Make a root directory with the service of this file, and return the service's name."""
    units = folder / "etc/systemd/system"
    name = f"rmf-bridge@{file.stem}.service"
    (units / f"{name}.d").mkdir(parents=True)
    for each in (UNIT, FILES / "rmf-bridges.target"):
        shutil.copy(each, units)
    (units / f"{name}.d/10-enable.conf").write_text(text(load(file), GROUPS))
    return name


def exposure(folder: Path, name: str) -> float:
    """Return the score of `systemd-analyze security`, from 0 (exposes nothing) to 10."""
    done = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", f"--root={folder}", name],
        capture_output=True,
        text=True,
        check=True,
    )
    found = re.search(r"Overall exposure level for .*: ([0-9.]+) ", done.stdout)
    assert found, done.stdout
    assert not done.stderr  # for example "Unknown key name"
    return float(found[1])


@needs_systemd
@pytest.mark.parametrize("file", CONFIG, ids=lambda file: file.stem)
def test_the_service_of_each_shipped_file_stays_within_the_limit_of_exposure(
    file: Path, tmp_path: Path
) -> None:
    score = exposure(tmp_path, system(tmp_path, file))
    assert score <= MOST


@needs_systemd
@pytest.mark.parametrize(
    ("service", "most"),
    # EARLY starts as root, because each of its child processes changes to the user of one service.
    [(RECORDER, 1.0), (PAGE, 1.5), (EXPORTER, 1.5), (NOTIFY, 1.5), (EARLY, 3.0)],
)
def test_the_other_units_are_no_more_exposed_than_this(
    tmp_path: Path, service: Path, most: float
) -> None:
    units = tmp_path / "etc/systemd/system"
    units.mkdir(parents=True)
    shutil.copy(service, units)
    assert exposure(tmp_path, service.name) <= most


@needs_systemd
def test_systemd_finds_nothing_wrong_with_the_units(tmp_path: Path) -> None:
    name = system(tmp_path, ROOT / "config/door_rs485.yaml")
    units = tmp_path / "etc/systemd/system"
    program = "/opt/rmf-bridges/.venv/bin/rmf-bridge"
    others = [units / "rmf-bridges.target", *(units / each.name for each in OTHERS)]
    for each in OTHERS:
        shutil.copy(each, units)
    for unit in (units / "rmf-bridge@.service", *others):
        unit.write_text(unit.read_text().replace(program, "/bin/true").replace("man:", "file:/"))
    (units / "rmf-bridge@.service").rename(units / name)
    done = subprocess.run(
        [*VERIFY, units / name, *others],
        capture_output=True,
        text=True,
    )
    ours = [line for line in done.stderr.splitlines() if "rmf" in line]
    assert (done.returncode, ours) == (0, [])


def test_the_unit_without_a_drop_in_permits_no_device() -> None:
    lines = UNIT.read_text().splitlines()
    assert "DevicePolicy=closed" in lines
    assert not [line for line in lines if line.startswith(("DeviceAllow", "SupplementaryGroups"))]
    assert "Environment=RMF_BRIDGE_SERVICE=1 RMF_BRIDGE_FITS=nothing PYTHONUNBUFFERED=1" in lines


def test_services_of_one_user_do_not_read_what_the_others_keep() -> None:
    users, kept, hidden = dict[Path, str](), dict[Path, str](), dict[Path, str]()
    for unit in (PAGE, EXPORTER, NOTIFY):
        settings = dict(re.findall(r"^(\w+)=(.*)$", unit.read_text(), re.M))
        users[unit] = settings["User"]
        kept[unit] = settings.get("StateDirectory", "")
        hidden[unit] = settings["InaccessiblePaths"]
    for unit in users:
        others = {kept[one] for one in users if users[one] == users[unit] and one != unit} - {""}
        assert set(hidden[unit].split()) == {f"-%S/{each}" for each in others}


def test_the_command_at_boot_may_end_a_child_that_has_become_a_services_user() -> None:
    (line,) = re.findall(r"^CapabilityBoundingSet=(.*)$", EARLY.read_text(), re.M)
    assert line.split() == ["CAP_CHOWN", "CAP_KILL", "CAP_SETGID", "CAP_SETUID"]


def test_can_recovers_automatically_after_a_bus_off() -> None:
    network = configparser.ConfigParser()
    network.read(FILES / "80-rmf-can0.network")
    assert dict(network["CAN"]) == {"bitrate": "250K", "restartsec": "100ms"}

"""The doctor's findings on made-up machines: users, clock, watchdog, disks, serial ports, CAN."""

import json
import os
from pathlib import Path

import pytest

from bridges.system.directories import Directories, user_of
from tests.workbench.commissioning.doctor.made_up import OTHERS, OURS, MadeUp
from workbench.commissioning.doctor import health
from workbench.commissioning.doctor.can import interface
from workbench.commissioning.doctor.finding import Finding, exit_code, note, ok, warning, wrong
from workbench.commissioning.doctor.machine import Machine
from workbench.commissioning.doctor.ports import port
from workbench.commissioning.doctor.users import UNIT, user, users

BY_ID = "/dev/serial/by-id/usb-FTDI_RS485-if00-port0"


@pytest.fixture
def made(tmp_path: Path) -> MadeUp:
    return MadeUp(tmp_path)


def told(findings: list[Finding]) -> list[tuple[str, str]]:
    return [(one.level, one.found) for one in findings]


def test_the_exit_code_is_that_of_the_worst_finding() -> None:
    well, worth = ok("a", "b"), note("a", "b")
    bad, worse = warning("a", "b", "c", "d"), wrong("a", "b", "c", "d")
    assert [exit_code(found) for found in ([], [well, worth], [bad, well], [worse, bad])] == [
        *(0, 0, 1, 2)
    ]


def test_without_the_unit_the_user_who_asks_counts_as_the_daemons(made: MadeUp) -> None:
    assert told(list(users(made.machine, user(made.machine, "lift")))) == [
        ("note", f"the unit {UNIT} is not installed; the findings below are for pi")
    ]
    assert [(who := user(made.machine, "lift")).name, who.service] == ["pi", False]


def test_a_unit_whose_user_and_groups_are_missing_cannot_start(made: MadeUp) -> None:
    made.write(f"/etc/systemd/system/{UNIT}")
    made.write("/etc/group", "root:x:0:\n")
    groups = "sudo groupadd --system gpio; sudo groupadd --system dialout"
    assert [(one.level, one.do) for one in users(made.machine, user(made.machine, "lift"))] == [
        ("wrong", "sudo useradd --system --no-create-home rmf-bridge"),
        ("wrong", f"{groups}; then sudo rmf-bridge enable FILE"),
    ]


def test_the_services_user_has_the_groups_of_the_unit(made: MadeUp) -> None:
    made.write(f"/etc/systemd/system/{UNIT}")
    made.write("/etc/passwd", "rmf-bridge:x:990:991::/:/usr/sbin/nologin\n")
    assert told(list(users(made.machine, user(made.machine, "lift")))) == [
        ("ok", "the service runs as rmf-bridge, in the groups gpio, dialout")
    ]
    assert user(made.machine, "lift").gids == {991, OURS}


def test_a_service_that_was_enabled_has_a_user_of_its_own(made: MadeUp) -> None:
    made.write(f"/etc/systemd/system/{UNIT}")
    own = user_of("lift")
    made.write("/etc/passwd", f"rmf-bridge:x:990:991::/:/x\n{own}:x:989:991::/:/x\n")
    names = [user(made.machine, service).name for service in ("lift", "door")]
    assert names == [own, "rmf-bridge"]


@pytest.mark.parametrize(
    ("synchronised", "printed", "found"),
    [
        (True, "NTP=no", [("ok", "the clock is synchronised")]),  # chrony replaces NTP
        (False, "NTP=no", [("warning", "the clock is not synchronised, and NTP is off")]),
        (False, "NTP=yes", [("warning", "the clock is not synchronised")]),
        (None, "", [("note", "the kernel does not show whether the clock is synchronised")]),
    ],
)
def test_the_clock_is_judged_by_the_kernel_and_ntp(
    made: MadeUp, synchronised: bool | None, printed: str, found: list[tuple[str, str]]
) -> None:
    made.synchronised = synchronised
    made.command("timedatectl", printed)
    assert told(list(health.clock(made.machine))) == found


def test_this_machines_kernel_says_whether_its_clock_is_synchronised() -> None:
    assert Machine().synchronised() in (True, False, None)


@pytest.mark.parametrize(
    ("device", "fed", "level"),
    [
        (False, "10s\n", "warning"),
        (True, "10s\n", "ok"),
        (True, "0\n", "warning"),
        (True, "infinity\n", "warning"),
        (True, None, "note"),
    ],
)
def test_the_hardware_watchdog_must_exist_and_be_fed(
    made: MadeUp, device: bool, fed: str | None, level: str
) -> None:
    if device:
        made.write("/dev/watchdog0")
    if fed is not None:
        made.command("systemctl", fed)
    assert [one.level for one in health.watchdog(made.machine)] == [level]


def test_a_command_that_fails_or_hangs_prints_nothing(made: MadeUp) -> None:
    made.write("/usr/bin/timedatectl", "#!/bin/sh\nexit 1\n", 0o755)
    assert made.machine.printed("timedatectl", "show") is None
    assert made.machine.printed("nothing-of-this-name") is None


def room(free: int, whole: int, flag: int = 0, inodes: int = 9) -> os.statvfs_result:
    return os.statvfs_result((4096, 4096, whole, free, free, 9, inodes, inodes, flag, 255))


@pytest.mark.parametrize(
    ("found", "level"),
    [
        (room(100_000, 1_000_000), "ok"),
        (room(1_000, 1_000_000), "warning"),
        (room(200, 1_000), "ok"),  # a small disk in memory (tmpfs)
        (room(0, 1_000_000), "wrong"),
        (room(100_000, 1_000_000, os.ST_RDONLY), "wrong"),
        (room(100_000, 1_000_000, inodes=0), "wrong"),
    ],
)
def test_a_disk_is_judged_by_what_is_free(found: os.statvfs_result, level: str) -> None:
    assert health.disk("the state directory", found).level == level


def test_a_directory_that_the_user_may_not_write_is_wrong(tmp_path: Path) -> None:
    made = MadeUp(tmp_path, gids=[OTHERS])
    (tmp_path / "run").mkdir(mode=0o755)
    places = Directories(Path("/run/rmf-bridge/lift"), Path("/run/rmf-bridge/lift"))
    found = list(health.directories(made.machine, places, made.user))
    assert [one.found for one in found if one.level == "wrong"] == [
        "pi may not write in /run, where /run/rmf-bridge/lift belongs"
    ]


def test_a_port_that_exists_and_is_permitted_is_well(made: MadeUp) -> None:
    made.write("/dev/ttyUSB0")
    made.link(BY_ID, "../../ttyUSB0")
    assert list(port(made.machine, BY_ID, made.user, served=False)) == [
        ok("serial port", f"{BY_ID} is there, and pi may use this port")
    ]


def test_a_missing_port_is_wrong_and_existing_ones_are_named(made: MadeUp) -> None:
    made.write("/dev/ttyUSB0")
    made.link(BY_ID, "../../ttyUSB0")
    (found,) = port(made.machine, "/dev/ttyUSB7", made.user, served=False)
    assert (found.level, found.do) == ("wrong", f"plug it in, or write one of: {BY_ID}")


def test_a_port_by_its_number_is_warned_of_with_the_path_that_stays(made: MadeUp) -> None:
    made.write("/dev/ttyUSB0")
    made.link(BY_ID, "../../ttyUSB0")
    _, found = port(made.machine, "/dev/ttyUSB0", made.user, served=False)
    assert (found.level, found.do) == ("warning", f"port: {BY_ID}")


def test_a_port_that_the_user_may_not_open_names_the_group(tmp_path: Path) -> None:
    made = MadeUp(tmp_path, gids=[OTHERS])
    made.write("/dev/ttyAMA0")
    made.write("/etc/group", f"dialout:x:{OURS}:\n")
    (found,) = port(made.machine, "/dev/ttyAMA0", made.user, served=False)
    assert (found.level, found.found, found.do) == (
        "wrong",
        "pi may not open /dev/ttyAMA0 (mode 660, group dialout)",
        "sudo usermod -aG dialout pi, then log in again",
    )


def test_the_console_of_the_kernel_on_the_port_is_wrong(made: MadeUp) -> None:
    made.write("/dev/ttyAMA0")
    made.link("/dev/serial0", "ttyAMA0")
    made.write("/proc/cmdline", "console=serial0,115200 console=tty1 root=/dev/mmcblk0p2\n")
    *_, found = port(made.machine, "/dev/ttyAMA0", made.user, served=False)
    assert told([found]) == [("wrong", "the kernel's console is on /dev/ttyAMA0")]


def test_a_program_that_has_the_port_open_is_named_unless_it_is_our_daemon(made: MadeUp) -> None:
    made.write("/dev/ttyAMA0")
    made.write("/proc/77/cgroup", "0::/system.slice/ModemManager.service\n")
    made.write("/proc/77/cmdline", "ModemManager\0")
    made.link("/proc/77/fd/5", str(made.root / "dev/ttyAMA0"))
    *_, found = port(made.machine, "/dev/ttyAMA0", made.user, served=False)
    assert told([found]) == [("wrong", "/dev/ttyAMA0 is open in ModemManager.service")]
    assert len(list(port(made.machine, "/dev/ttyAMA0", made.user, served=True))) == 1


def can0(made: MadeUp, flags: str = "0x1", **data: object) -> None:
    made.write("/sys/class/net/can0/type", "280\n")
    made.write("/sys/class/net/can0/flags", f"{flags}\n")
    info = {"info_kind": "can", "info_data": data}
    made.command("ip", json.dumps([{"ifname": "can0", "linkinfo": info}]))


def can_found(made: MadeUp, bitrate: int | None = None) -> list[tuple[str, str]]:
    return told(list(interface(made.machine, "can0", bitrate)))


def test_an_interface_that_is_up_and_recovers_by_itself_is_well(made: MadeUp) -> None:
    can0(made, state="ERROR-ACTIVE", bittiming={"bitrate": 250000}, restart_ms=100)
    text = "can0 is up at 250000 bit/s; the stations need the same bitrate"
    assert can_found(made, 250_000) == [("ok", text)]


def test_each_fault_of_a_can_interface_is_named(made: MadeUp) -> None:
    can0(made, state="BUS-OFF", bittiming={"bitrate": 500000})
    assert can_found(made, 250_000) == [
        ("warning", "can0 has 500000 bit/s, but the stations' default is 250000 bit/s"),
        ("wrong", "can0 is bus-off: the controller has left the bus"),
        ("warning", "can0 has no restart-ms"),
    ]
    can0(made, state="ERROR-PASSIVE", bittiming={"bitrate": 500000}, restart_ms=100)
    assert can_found(made)[1:] == [("warning", "can0 is error-passive")]


def test_an_interface_that_is_down_or_missing_or_not_can_is_wrong(made: MadeUp) -> None:
    assert can_found(made) == [("wrong", "there is no interface can0; CAN interfaces here: none")]
    can0(made, flags="0x80")
    assert can_found(made) == [("wrong", "can0 is down")]
    made.write("/sys/class/net/can0/type", "1\n")
    assert can_found(made) == [("wrong", "can0 is not a CAN interface")]


def test_without_the_command_ip_the_bitrate_is_not_known(made: MadeUp) -> None:
    can0(made)
    (made.root / "usr/bin/ip").unlink()
    assert can_found(made) == [("note", "can0 is up; only the command ip can show its bitrate")]

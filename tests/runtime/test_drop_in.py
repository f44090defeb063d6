"""The permissions in the systemd drop-in of a service. They depend on the buses to the devices and on
the transport to RMF's graph."""

from pathlib import Path

import pytest

from bridges.commands.run import too_slow
from bridges.runtime.drop_in import FITS, fits, misfit, text, watchdog_s
from bridges.settings.load import Config, load, understood
from bridges.system.directories import GROUPS
from workbench.commissioning.examples import device_yamls

CONFIG = Path(__file__).parents[2] / "config"
USB = ["modprobe@usbserial.service modprobe@cdc_acm.service"]
SERIAL = [
    f"Wants={USB[0]}",
    f"After={USB[0]}",
    "WatchdogSec=3",
    "DeviceAllow=char-ttyUSB rw",
    "DeviceAllow=char-ttyACM rw",
    "SupplementaryGroups=dialout",
]
GPIO = ["WatchdogSec=3", "DeviceAllow=char-gpiochip rw", "SupplementaryGroups=gpio"]
CAN = ["WatchdogSec=3", "PrivateDevices=yes", "RestrictAddressFamilies=AF_CAN"]
NET = ["WatchdogSec=3", "PrivateDevices=yes"]
GRAPH = ["WatchdogSec=10", "PrivateDevices=yes"]
FLEET = ["WatchdogSec=6", "PrivateDevices=yes"]  # RMF's adapter stops the process for 3 s
SHIPPED = {
    "alarm_http": NET,
    "alarm_panel": GPIO,
    "alarm_register": NET,
    "charger_canopen": CAN,
    "charger_contacts": NET,
    "charger_coordinator": GRAPH,
    "charger_http": NET,
    "charger_http_full": NET,
    "charger_modbus": SERIAL,
    "charger_mqtt": NET,
    "charger_register": SERIAL,
    "charger_relay": NET,
    "charger_wiferion": SERIAL,  # on an slcan adapter
    "dispenser_contacts": GPIO,
    "dispenser_register": NET,
    "door_http": NET,
    "door_line": SERIAL,
    "door_modbus": NET,
    "door_mqtt": NET,
    "door_register": NET,
    "door_rs485": SERIAL,
    "door_supervisor": GRAPH,
    "door_waveshare": SERIAL,
    "ingestor_http": NET,
    "lift_by_call": GPIO,
    "lift_dry_contact": GPIO,
    "lift_gateway": NET,
    "lift_gateway_contacts": SERIAL,
    "lift_http": NET,
    "lift_io_module": NET,
    "lift_low_level": GPIO,
    "lift_mqtt": NET,
    "lift_one_hot": GPIO,
    "lift_relay_board": GPIO,
    "lift_supervisor": GRAPH,
    "lift_two_buses": GPIO,
    "robots_http": FLEET,
    "robots_traffic_light": FLEET,
    "robots_vda5050": FLEET,
}


def permits(config: Config, groups: tuple[str, ...] = GROUPS) -> list[str]:
    """Return only the lines with permissions. Comments, section names and the drop-in's fingerprint are
    left out."""
    lines = text(config, groups).splitlines()
    return [line for line in lines if line[:1] not in ("#", "[") and FITS not in line]


def changed(name: str, *changes: tuple[str, str]) -> Config:
    yaml = (CONFIG / f"{name}.yaml").read_text()
    for old, new in changes:
        assert old in yaml
        yaml = yaml.replace(old, new)
    return understood(f"/etc/rmf-bridges/{name}.yaml", yaml.encode())


def test_each_shipped_file_is_permitted_what_it_needs_and_no_more() -> None:
    assert {f.stem: permits(load(f)) for f in device_yamls()} == SHIPPED


def test_the_whole_text_names_its_file_and_the_needs_that_it_meets() -> None:
    config = load(CONFIG / "lift_dry_contact.yaml")
    assert text(config, ["gpio"]).splitlines() == [
        "# Written by `rmf-bridge enable` for lift_dry_contact.yaml. If it changes, enable it again.",
        "[Service]",
        f"Environment=RMF_BRIDGE_FITS={fits(config)}",
        *GPIO,
    ]


def test_a_group_that_the_machine_does_not_have_is_left_out_and_changes_no_need() -> None:
    config = load(CONFIG / "lift_dry_contact.yaml")
    assert permits(config, ()) == GPIO[:2]
    assert FITS + "=" + fits(config) in text(config, ())


@pytest.mark.parametrize(
    ("port", "devices"),
    [
        ("/dev/ttyUSB0", ["char-ttyUSB"]),
        ("/dev/ttyACM1", ["char-ttyACM"]),
        ("/dev/ttyAMA0", ["char-ttyAMA"]),
        ("/dev/ttyS0", ["char-ttyS"]),
        ("/dev/serial0", ["char-ttyAMA", "char-ttyS"]),
        ("/dev/serial/by-path/platform-usb", ["char-ttyUSB", "char-ttyACM"]),
        ("/dev/lift_adapter", ["char-ttyUSB", "char-ttyACM"]),
        ("/dev/pts/3", ["char-pts"]),
    ],
)
def test_a_serial_port_is_permitted_by_the_class_of_its_adapter(
    port: str, devices: list[str]
) -> None:
    old = "/dev/serial/by-id/usb-FTDI_USB-RS485_Cable_FT123456-if00-port0"
    lines = permits(changed("door_rs485", (old, port)))
    assert [line for line in lines if "Device" in line] == [f"DeviceAllow={d} rw" for d in devices]


def test_one_chip_by_its_number_is_the_only_one_permitted() -> None:
    config = changed("lift_dry_contact", ("{type: gpio}", "{type: gpio, chip: 4}"))
    assert "DeviceAllow=/dev/gpiochip4 rw" in permits(config)


def test_an_slcan_adapter_is_a_serial_port() -> None:
    slcan = "slcan: {port: /dev/ttyACM0, bitrate: 250000}"
    lines = permits(changed("charger_canopen", ("socketcan: can0", slcan)))
    assert "DeviceAllow=char-ttyACM rw" in lines
    assert not [line for line in lines if "AF_CAN" in line]


LOCAL = "localhost multicast"
ROUTERS = "zenoh: {connect: [tcp/10.0.0.5:7447, 'tls/[fd00::5]:7447']}"


@pytest.mark.parametrize(
    ("rmf", "hosts"),
    [
        ("transport: dds", None),
        ("transport: ros2", None),
        ("transport: auto", None),
        ("transport: auto\n  network: localhost", LOCAL),
        ("transport: zenoh\n  network: localhost", LOCAL),
        ("transport: zenoh", None),  # a zenoh peer may hear of peers at any address
        (f"transport: zenoh\n  {ROUTERS}", f"{LOCAL} 10.0.0.5 fd00::5"),
        ("transport: zenoh\n  zenoh: {mode: client}", LOCAL),
        ("transport: zenoh\n  zenoh: {connect: [tcp/router.local:7447]}", None),
    ],
)
def test_the_network_is_limited_where_every_address_is_known(rmf: str, hosts: str | None) -> None:
    lines = permits(changed("lift_dry_contact", ("transport: auto ", f"{rmf} ")))
    limits = [line for line in lines if "IPAddress" in line]
    assert limits == ([] if hosts is None else ["IPAddressDeny=any", f"IPAddressAllow={hosts}"])


def test_a_controllers_address_is_permitted_and_its_name_lifts_the_limit() -> None:
    here = ("transport: auto\n", "transport: auto\n  network: localhost\n")
    assert f"IPAddressAllow={LOCAL} 192.168.1.70" in permits(changed("door_http", here))
    name = ("192.168.1.70", "relay.lan")
    assert not [x for x in permits(changed("door_http", here, name)) if "IPAddress" in x]


@pytest.mark.parametrize(
    ("timeout_s", "expected_s"), [(0.2, 3), (0.9, 3), (1.0, 3), (2.0, 4.75), (5, 10)]
)
def test_the_watchdogs_time_follows_from_the_slowest_call(
    timeout_s: float, expected_s: float
) -> None:
    config = changed(
        "charger_http",
        ('api_base: "192.168.1.60/api"', f'api_base: "192.168.1.60/api", timeout_s: {timeout_s}'),
    )
    assert watchdog_s(config) == expected_s
    assert too_slow(config, watchdog_s(config)) == ""
    fed_every_s = watchdog_s(config) / 6 + 1 + timeout_s  # `_watch` + a scan + a call
    assert fed_every_s < watchdog_s(config)


def test_a_drop_in_for_other_needs_is_refused_with_what_to_do() -> None:
    ours = changed("door_rs485")
    same = changed("door_rs485", ("ward_door", "other_door"), ("19200", "9600"))
    other = changed("door_rs485", ("/dev/serial/by-id/usb-FTDI_USB-RS485", "/dev/ttyAMA0"))
    do = "run `sudo rmf-bridge enable /etc/rmf-bridges/door_rs485.yaml`"
    assert [misfit(config, {FITS: fits(ours)}) for config in (ours, same, other)] == [
        "",
        "",
        f"/etc/rmf-bridges/door_rs485.yaml: the unit has a drop-in for other buses or durations: {do}",
    ]
    assert misfit(ours, {}) == ""
    assert misfit(ours, {FITS: "nothing"}) == (
        f"/etc/rmf-bridges/door_rs485.yaml: the unit has no drop-in: {do}"
    )

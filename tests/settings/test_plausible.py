"""Some values fit the types, but no integrator intends them. They give an error or a warning."""

from pathlib import Path

import pytest

from bridges.settings.load import load
from tests.settings.reading import problems_of

DOOR = """\
kind: door
driver: dry_contact
buses:
  module: {type: modbus, tcp: {host: 192.168.1.50}, without_watchdog: {1: a bench}}
doors:
  ward:
    inputs:
      opened: {point: unit 1 discrete input 0, active: high}
      closed: {point: unit 1 discrete input 1, active: high}
    outputs:
      hold_open: {point: unit 1 coil 0, active: high}
"""
LINE = "serial: {port: /dev/serial/by-id/x, baudrate: 9600, parity: none, stopbits: 1}"
TCP = "tcp: {host: 192.168.1.50}"


def door(bus: str = TCP, rmf: str = "{}", limits: str = "{}") -> str:
    """Return the YAML of a door with this bus, RMF section and limits."""
    text = DOOR.replace(TCP, bus).replace("buses:", f"rmf: {rmf}\nbuses:")
    return f"{text}    limits: {limits}\n"


def warnings_of(file: Path, text: str) -> list[str]:
    """Return the warnings as `line:column: text`."""
    file.write_text(text)
    return [str(w).removeprefix(f"{file}:") for w in load(file).warnings]


def test_the_unchanged_door_gives_no_problem_and_no_warning(file: Path) -> None:
    assert warnings_of(file, door()) == []


def test_a_call_that_outlasts_the_readings_gives_a_warning(file: Path) -> None:
    slow = door(f"{TCP}, timeout_s: 1.2, retries: 1")
    assert warnings_of(file, slow) == [
        "5:64: warning: bus 'module': a call to a silent device takes 2.4 s (timeout_s x 2"
        " attempts), but stale_after_s is 1: RMF hears only later that the device is silent; lower"
        " timeout_s, or raise stale_after_s"
    ]
    assert warnings_of(file, door(f"{TCP}, timeout_s: 0.5, retries: 1")) == []


KEEPS = (
    "when this machine or the cable dies: arm the watchdog of the module (module_watchdog), or write"
    " why that is safe (without_watchdog)"
)
BARE = door().replace(", without_watchdog: {1: a bench}", "")
WATCHED = door(f"{TCP}, module_watchdog: {{units: [1], profile: wago-750}}")
LAB = BARE[BARE.index("  ward:") :].replace("ward", "lab").replace("unit 1", "unit 7")


def test_outputs_without_a_watchdog_give_one_warning_for_each_bus(file: Path) -> None:
    one = f"5:3: warning: bus 'module': unit 1 keeps its outputs {KEEPS}"
    assert warnings_of(file, BARE) == [one]
    two = f"5:3: warning: bus 'module': units 1, 7 keep their outputs {KEEPS}"
    assert warnings_of(file, BARE + LAB) == [two]
    flashed = BARE.replace("coil 0, active: high", "coil 0, active: high, flash: unit 1 coil 512")
    assert warnings_of(file, f"{flashed}    pulse: {{on_s: 0.7, every_s: 3}}\n") == []


def test_the_file_states_why_a_unit_may_keep_its_outputs(file: Path) -> None:
    file.write_text(door())
    assert [str(note).removeprefix(f"{file}:") for note in load(file).notes] == [
        "5:75: note: bus 'module': unit 1 has no module_watchdog: a bench"
    ]
    assert warnings_of(file, door().replace("{1: a bench}", "{1: a bench, 3: x}")) == [
        "5:87: warning: bus 'module': the daemon writes nothing to unit 3: delete this entry"
    ]
    assert problems_of(file, WATCHED) == [
        "5:125: 'without_watchdog': unit 1 is in module_watchdog too: delete one of the two"
    ]


QUICK = """\
kind: door
driver: dry_contact
rmf: {{}}
buses:
  module:
    {{type: modbus, tcp: {{host: 192.168.1.50}}, timeout_s: 0.1, retries: 0, scan_s: {scan_s},
    module_watchdog: {{units: [1], habits: {{time_s: 0.5, refresh_s: 0.25,
    arm: [{{at: coil 8, value: 1}}], armed: [{{at: coil 8, values: [1]}}],
    refresh: {{at: coil 9, values: [0, 1]}}}}}}}}
doors:
  ward:
    inputs:
      opened: {{point: unit 1 discrete input 0, active: high}}
      closed: {{point: unit 1 discrete input 1, active: high}}
    outputs:
      hold_open: {{point: unit 1 coil {out}, active: high}}
"""


REFUSED = {
    "a bus that is read too seldom": (
        door(f"{TCP}, scan_s: 2", limits="{stale_after_s: 1.5}"),
        "13:29: stale_after_s is 1.5, but its bus is read every 2 s (scan_s): readings would"
        " always be stale; raise stale_after_s above 2, or lower scan_s",
    ),
    "a timeout of nothing": (
        door(limits="{open_timeout_s: 0}"),
        "13:30: 'open_timeout_s' is 0: write a number from 1 to 86400 s",
    ),
    "a contact that counts after the limit that waits for it": (
        door(limits="{open_timeout_s: 5}").replace(
            "0, active: high}", "0, active: high, debounce_s: 5}", 1
        ),
        "13:30: open_timeout_s is 5, but opened counts 5 s late (debounce): write a longer",
    ),
    "a watchdog that trips between two scans": (
        QUICK.format(scan_s=0.9, out=0),
        "6:83: after a scan every 0.9 s and a refresh every 0.25 s the watchdog's 0.5 s are over",
    ),
    "an output that refreshes the watchdog": (
        QUICK.format(scan_s=0.1, out=9),
        "16:26: unit 1 coil 9 is used by module module_watchdog.habits on line 7: ward outputs.",
    ),
    "a topic that RMF has not": (
        door(rmf="{topics: {dor_states: x}}"),
        "3:16: unknown topic 'dor_states': did you mean 'door_states'? known here: ",
    ),
    "a unit that is everybody": (
        door(LINE).replace("unit 1 coil", "unit 0 coil"),
        "12:26: unit 0 addresses all units at once, so no unit answers: units on a serial line"
        " are 1 to 247",
    ),
    "a unit that only TCP has": (
        door(LINE).replace("unit 1 coil", "unit 255 coil"),
        "12:26: unit 255 is for Modbus TCP: units on a serial line are 1 to 247",
    ),
    "a rate that no unit has": (
        door(LINE.replace("9600", "9800")),
        "5:72: 'baudrate': 9800 is not a rate that units have: 300, 600, 1200, 2400, 4800, 9600, ",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_an_implausible_setting_is_refused(file: Path, what: str) -> None:
    text, problem = REFUSED[what]
    found = problems_of(file, text)
    assert len(found) == 1
    assert found[0].startswith(problem)


WARNED = {
    "milliseconds": (
        door(limits="{close_grace_s: 3000}"),
        "13:29: warning: 'ward': close_grace_s is 3000 s, 50 minutes: if milliseconds are meant,"
        " write 3",
    ),
    "an hour that is meant": (
        door(limits="{max_hold_s: 7200}"),
        "13:26: warning: 'ward': max_hold_s is 7200 s, 2.0 hours: if milliseconds are meant,"
        " write 7.2",
    ),
}


HEADER = """\
kind: door
driver: dry_contact
buses: {header: {type: gpio}}
doors:
  ward:
    inputs:
      opened: {point: BCM4, active: high, pull: down}
      closed: {point: PIN, active: low, pull: up}
    outputs:
      hold_open: {point: BCM18, active: high}
"""
OFF = "use another pin, or disable this function of the pin in config.txt"
PINS = {
    "BCM2": "BCM2 is for I2C (dtparam=i2c_arm=on), and has a fixed 1.8 kΩ pull-up",
    "J8:5": "BCM3 is for I2C (dtparam=i2c_arm=on), and has a fixed 1.8 kΩ pull-up",
    "BCM0": "BCM0 is for a HAT's EEPROM, which the firmware reads at boot",
    "BCM14": "BCM14 is for the serial console, which drives the pin at boot (enable_uart=1)",
    "BCM15": "BCM15 is for the serial console (enable_uart=1)",
}


@pytest.mark.parametrize("pin", PINS)
def test_a_warning_names_the_pin_that_the_firmware_uses(file: Path, pin: str) -> None:
    assert warnings_of(file, HEADER.replace("PIN", f'"{pin}"')) == [
        f"8:7: warning: 'ward': 'closed': {PINS[pin]}; {OFF}"
    ]


def test_a_pin_that_is_free_of_the_firmware_gives_no_warning(file: Path) -> None:
    assert warnings_of(file, HEADER.replace("PIN", "BCM5")) == []


@pytest.mark.parametrize("what", WARNED)
def test_an_unlikely_setting_gives_a_warning(file: Path, what: str) -> None:
    text, warning = WARNED[what]
    assert warnings_of(file, text) == [warning]


def test_an_alarm_with_a_long_debounce_gives_a_warning(file: Path) -> None:
    fire = (
        "    outputs:",
        "      fire: {point: unit 1 discrete input 2, active: low, debounce_s: 10}",
    )
    text = door().replace(fire[0], f"{fire[1]}\n{fire[0]}") + "    on_fire: open\n"
    assert warnings_of(file, text) == [
        "11:71: warning: 'ward': fire is noticed only after 10 s, but contacts bounce for only 0.05 s"
    ]

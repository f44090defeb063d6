"""A place that the daemon writes cannot tell the device's state. Otherwise the daemon would take its
own command for the device's answer: a door would be open because it was ordered to open."""

from pathlib import Path

import pytest

from bridges.settings.load import SettingsError, load

CONFIG = Path(__file__).parents[2] / "config"
DOORS = """\
kind: door
driver: register
buses: {plc: {type: modbus, tcp: {host: 192.168.1.50}, without_watchdog: {1: a bench}}}
doors:
  A:
    unit: 1
    map:
      status: {at: holding register 0, closed: [0], moving: [2], open: [1]}
      command: {at: holding register 1, hold: 1, release: 0}
  B:
    unit: 1
    map:
      status: {at: holding register 1, closed: [0], moving: [2], open: [1]}
      command: {at: holding register 3, hold: 1, release: 0}
"""


def problems(text: str, folder: Path) -> list[str]:
    """Return the complaints about this file, without its name."""
    file = folder / "device.yaml"
    file.write_text(text)
    try:
        load(file)
    except SettingsError as error:
        return [str(one).removeprefix(f"{file}:") for one in error.problems]
    return []


@pytest.mark.parametrize(
    ("example", "read", "instead", "says"),
    [
        (
            "lift_gateway.yaml",
            "at: input register 2",
            "at: holding register 10",
            "unit 1 holding register 10 is written by Lift1 map.commands.agv_mode_request.at",
        ),
        (
            "dispenser_register.yaml",
            "at: input register 0",
            "at: holding register 2",
            "holding register 2 is written by linen_store map.quantity.at",
        ),
        (
            "charger_register.yaml",
            "in_range: {at: discrete input 0}",
            "in_range: {at: coil 0}",
            "unit 3 coil 0 is written by charger_f map.power.at",
        ),
        (
            "charger_register.yaml",
            "state: {at: input register 0}",
            "state: {at: holding register 15, words: 2}",
            "holding register 16 is written by charger_f map.clear_error.at",
        ),
        (
            "door_http.yaml",
            'opened: {field: "input:0.state"}',
            'opened: {field: "switch:0.output"}',
            "is the field of held, which shows the relay, and not the door",
        ),
    ],
)
def test_a_state_at_the_place_of_a_command_is_refused(
    example: str, read: str, instead: str, says: str, tmp_path: Path
) -> None:
    text = (CONFIG / example).read_text()
    assert read in text
    line = text[: text.index(read)].count("\n") + 1
    (said,) = problems(text.replace(read, instead, 1), tmp_path)
    assert says in said
    assert said.startswith(f"{line}:")


def test_a_state_at_the_place_of_another_devices_command_is_refused(tmp_path: Path) -> None:
    said = (
        "13:20: unit 1 holding register 1 is written by A map.command.at on line 9: a state needs"
    )
    assert problems(DOORS, tmp_path) == [f"{said} a place that the device itself writes"]
    apart = DOORS.replace("status: {at: holding register 1", "status: {at: holding register 2")
    assert problems(apart, tmp_path) == []


@pytest.mark.parametrize(("bits", "refused"), [("[4, 5]", False), ("[1, 5]", True)])
def test_a_state_may_share_a_register_with_other_bits(
    bits: str, refused: bool, tmp_path: Path
) -> None:
    """The commands of the example use bits 0 and 1 of holding register 10."""
    text = (CONFIG / "lift_gateway.yaml").read_text()
    shared = text.replace("at: input register 1", f"at: holding register 10\n        bits: {bits}")
    assert bool(problems(shared, tmp_path)) == refused

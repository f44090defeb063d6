"""The tables that `check` prints for the codes of a lift.

The tables show what each code reads when a line is cut. The tests make likely mistakes in the file, and
expect that the tables show them.
"""

from pathlib import Path

from bridges.settings.load import load
from bridges.settings.sheets.findings import findings
from bridges.settings.sheets.text import lines

SHIPPED = Path(__file__).parents[3] / "config" / "lift_dry_contact.yaml"
PARITY = '      parity: {point: "J8:33", active: high, pull: down, total: even}\n'
MORE = """\
      service:
        bits:
          - {point: "J8:37", active: high, pull: down}
          - {point: "J8:36", active: low, pull: down}
        codes: {0: normal, 1: overload, 2: emergency, 3: out_of_service}
      motion:
        bits: [{point: "J8:38", active: high, pull: down}]
        codes: {0: stopped, 1: moving}
"""
DOOR_OPEN = '      door_open: {point: "J8:36", active: high}\n'


def table(tmp_path: Path, title: str, *changes: tuple[str, str]) -> list[str]:
    """Return the table with this title for `config/lift_dry_contact.yaml`, after these changes to the
    file."""
    text = SHIPPED.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file = tmp_path / "lift.yaml"
    file.write_text(text)
    shown = lines(findings(load(file)), 200)
    first = shown.index(f"Lift1: {title}")
    return [" ".join(line.split()) for line in shown[first + 2 : shown.index("", first)]]


def test_each_floor_has_its_code_its_lines_and_what_a_cut_makes_of_it(tmp_path: Path) -> None:
    assert table(tmp_path, "floor code (binary)") == [
        "between floors 0 none nothing changes",
        "L1 1 floor_bit0, floor_parity a fault: floor_bit0, floor_parity",
        "L2 2 floor_bit1, floor_parity a fault: floor_bit1, floor_parity",
        "L3 3 floor_bit0, floor_bit1 a fault: floor_bit0, floor_bit1",
        "L4 4 floor_bit2, floor_parity a fault: floor_bit2, floor_parity",
    ]


def test_without_parity_a_cut_line_reads_as_another_floor(tmp_path: Path) -> None:
    assert table(tmp_path, "floor code (binary)", (PARITY, "")) == [
        "between floors 0 none nothing changes",
        "L1 1 floor_bit0 between floors: floor_bit0",
        "L2 2 floor_bit1 between floors: floor_bit1",
        "L3 3 floor_bit0, floor_bit1 L2: floor_bit0; L1: floor_bit1",
        "L4 4 floor_bit2 between floors: floor_bit2",
    ]


def test_a_line_that_floats_may_read_either_way(tmp_path: Path) -> None:
    bit = (
        '{point: "J8:32", active: high, pull: down}',
        '{point: "J8:32", active: high, pull: none}',
    )
    assert table(tmp_path, "floor code (binary)", (PARITY, ""), bit)[:2] == [
        "between floors 0 none L4: floor_bit2",
        "L1 1 floor_bit0 between floors: floor_bit0; a fault: floor_bit2",
    ]


def test_floors_upside_down_are_seen(tmp_path: Path) -> None:
    upside_down = ("floors: [L1, L2, L3, L4]", "floors: [L4, L3, L2, L1]")
    assert table(tmp_path, "floors", upside_down) == [
        "lowest L4 L4 door",
        "2 L3 L3 door",
        "3 L2 L2 door",
        "highest L1 L1 door",
    ]


def test_codes_that_are_swapped_are_seen(tmp_path: Path) -> None:
    swapped = ("{1: L1, 2: L2, 3: L3, 4: L4}", "{2: L1, 1: L2, 3: L3, 4: L4}")
    assert table(tmp_path, "floor code (binary)", swapped)[1:3] == [
        "L1 2 floor_bit1, floor_parity a fault: floor_bit1, floor_parity",
        "L2 1 floor_bit0, floor_parity a fault: floor_bit0, floor_parity",
    ]


def test_the_table_says_how_long_a_call_lasts(tmp_path: Path) -> None:
    pulse = ("    inputs:\n", "    limits: {call_pulse_s: 0.5}\n    inputs:\n")
    assert table(tmp_path, "outputs", pulse) == [
        "agv_mode_request agv_mode_request on while a robot holds the lift, and 3 s longer",
        "door_open door_open on while the car waits for a robot",
        *(f"call L{n} call_L{n} one pulse of 0.5 s" for n in (1, 2, 3, 4)),
    ]


def test_service_and_motion_codes_are_listed_number_by_number(tmp_path: Path) -> None:
    more = ("    # A number on three lines", f"{MORE}    # A number on three lines")
    told = "the controller watches its lines"
    accepted = f"{{service_bit0: {told}, service_bit1: {told}, motion_bit0: {told}}}"
    accept = ("    inputs:\n", f"    accept_unsafe: {accepted}\n    inputs:\n")
    changes = (more, (DOOR_OPEN, ""), accept)
    assert table(tmp_path, "service code", *changes) == [
        "normal 0 none emergency: service_bit1",
        "overload 1 service_bit0 normal: service_bit0; out_of_service: service_bit1",
        "emergency 2 service_bit1 nothing changes",
        "out_of_service 3 service_bit0, service_bit1 emergency: service_bit0",
    ]
    assert table(tmp_path, "motion code", *changes) == [
        "stopped 0 none nothing changes",
        "moving 1 motion_bit0 stopped: motion_bit0",
    ]

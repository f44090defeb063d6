"""A charger on CAN that sends no state number.

Rules find the charger's state from an error number and a byte of flags.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import can
import msgspec
import pytest

from bridges.kinds.charger.signals import Activity
from drivers.charger import dbc
from drivers.charger.can_frames import (
    FrameChargerSettings,
    FrameDriver,
    create,
    decode,
    describe,
    frame_tables,
)
from drivers.charger.can_map import FrameMap
from drivers.hal import can as hal
from tests.drivers.charger.test_contract_can import Frames
from tests.drivers.hal.can.far_end import Reactive, failure

MAP: dict[str, Any] = {
    "dbc": str(Path(__file__).with_name("rules.dbc")),
    "state_timeout_s": 1,
    "amps": "Status.Current",
    "volts": "Status.Voltage",
    "receiver": "Pad.Receiver",
    "out_of_range": "Status.Beside",
    "rules": [
        {"means": "charging", "when": {"Status.Current": {"above": 0.5}}},
        {"means": "handshake", "when": {"Status.Relay": {"one_of": [1]}}},
        {"means": "idle", "when": {"Status.Relay": {"one_of": [0]}}},
        {"means": "error", "when": {"Status.Relay": {"one_of": [2]}}, "text": "the relay sticks"},
    ],
    "errors": {
        "codes": [
            {
                "at": "Status.Fault",
                "station": {17: "foreign object"},
                "robot": {33: "no receiver answers"},
            }
        ],
        "bits": [{"at": "Status.Flags", "station": {1: "too hot"}, "robot": {3: "battery"}}],
    },
    "send": [{"frame": "Command", "every_s": 0.5, "on": {"Enable": 1}, "off": {"Enable": 0}}],
}
BOTH = "too hot; no receiver answers"
SETTINGS = msgspec.convert({"map": MAP}, FrameChargerSettings)


class Charger:
    """A charger that broadcasts its status."""

    def __init__(self) -> None:
        self.far = Reactive()
        self.bus = self.far.bus()
        self.driver: FrameDriver = create("c", SETTINGS, self.bus)

    def shows(self, payload: str) -> tuple[Activity, int | str, str, str, bool]:
        """Return the driver's reading of a status.

        The reading is (activity, code, error text, side at fault, whether current flows).
        """
        for frame_id, said in ((0x100, payload), (0x101, "00 00 12 67")):
            data = bytes.fromhex(said)
            message = can.Message(arbitration_id=frame_id, is_extended_id=False, data=data)
            self.far.coming.append(message)
        sample = self.driver.read()
        return sample.activity, sample.code, sample.error_text, sample.side, sample.charges


@pytest.fixture
def charger() -> Iterator[Charger]:
    made = Charger()
    made.bus.take()
    made.driver.open()
    yield made
    made.bus.close()


@pytest.mark.parametrize(
    ("payload", "wanted"),
    [
        ("0000 0000 00 00 00 00", (Activity.IDLE, "rule 3", "", "", False)),
        ("0000 0000 01 00 00 00", (Activity.HANDSHAKE, "rule 2", "", "", False)),
        ("0081 0102 01 00 00 00", (Activity.CHARGING, "rule 1", "", "", False)),
        ("0000 0000 03 00 00 00", (Activity.UNKNOWN, "of no rule", "", "", False)),
        ("0000 0000 02 00 00 00", (Activity.ERROR, "rule 4", "the relay sticks", "", False)),
        ("0081 0102 01 11 00 00", (Activity.ERROR, "rule 1", "foreign object", "station", True)),
        ("0000 0000 01 21 00 00", (Activity.ERROR, "rule 2", "no receiver answers", "robot", False)),
        ("0000 0000 01 07 00 00", (Activity.ERROR, "rule 2", "error 7", "", False)),
        ("0000 0000 00 21 02 00", (Activity.ERROR, "rule 3", BOTH, "station", False)),
        ("0000 0000 00 00 50 00", (Activity.ERROR, "rule 3", "error bit 4; error bit 6", "", False)),
        ("0000 0000 00 00 08 00", (Activity.ERROR, "rule 3", "battery", "robot", False)),
    ],
)  # fmt: skip
def test_a_frame_without_a_state_number_is_judged_as_on_http_and_modbus(
    charger: Charger, payload: str, wanted: object
) -> None:
    assert charger.shows(payload) == wanted


def test_without_a_frame_that_rules_need_there_is_no_reading(charger: Charger) -> None:
    assert charger.shows("0000 0000 00 00 00 00")[0] is Activity.IDLE
    charger.far.now += 1.1
    assert "no Status (0x100)" in failure(charger.driver.read)


def test_check_tells_rules_numbers_and_bits() -> None:
    rows = describe(SETTINGS, hal.CanSettings(socketcan="can0"))
    assert ("rule 1", "Status.Current above 0.5 is charging") in rows
    assert ("station's error", "Status.Fault 17: foreign object") in rows
    assert ("robot's error", "Status.Flags bit 3: battery") in rows
    _, read = frame_tables(SETTINGS)
    assert [row[2:] for row in read.rows] == [
        ("00 00 01 02 00 00 00 00", "Voltage 25.8 V"),
        ("00 81 00 00 00 00 00 00", "Current 12.9 A"),
        ("00 00 12 67", "Receiver 4711"),
        ("00 00 00 00 04 00 00 00", "Beside 1"),
        ("00 00 00 00 00 11 00 00", "Fault 17: station's error, foreign object"),
        ("00 00 00 00 00 21 00 00", "Fault 33: robot's error, no receiver answers"),
        ("00 00 00 00 00 00 02 00", "Flags 2: station's error, too hot"),
        ("00 00 00 00 00 00 08 00", "Flags 8: robot's error, battery"),
        ("00 00 00 00 01 00 00 00", "Relay 1"),
    ]


PADS = """VERSION ""

NS_ :

BS_:

BU_: Bridge Charger

BO_ 256 State: 2 Charger
 SG_ Mode : 0|8@1+ (1,0) [0|255] "" Bridge
 SG_ InRange : 8|2@1+ (1,0) [0|1] "" Bridge
 SG_ AtHeight : 10|2@1+ (1,0) [0|3] "" Bridge

BO_ 257 Diag: 2 Charger
 SG_ Page M : 0|8@1+ (1,0) [0|255] "" Bridge
 SG_ Foreign m0 : 8|8@1+ (1,0) [0|255] "" Bridge
 SG_ Heat m1 : 8|8@1+ (1,0) [0|255] "" Bridge
"""


def pads(folder: Path, **more: Any) -> FrameMap:
    """Return a map with range and height, and these keys."""
    (folder / "pads.dbc").write_text(PADS)
    state = {"at": "State.Mode", "codes": {"idle": [0], "charging": [1]}}
    plain = {"dbc": str(folder / "pads.dbc"), "state_timeout_s": 1, "state": state, **more}
    send = [{"frame": "State", "every_s": 0.5, "on": {"Mode": 1}, "off": {"Mode": 0}}]
    return msgspec.convert({**plain, "send": send}, FrameMap)


def test_a_signal_that_only_some_frames_have_is_refused(tmp_path: Path) -> None:
    found = pads(
        tmp_path,
        amps="Diag.Page",
        errors={"station": {"Diag.Foreign": "foreign object"}},
        temperatures={"coil": "Diag.Heat"},
    )
    assert [(path, text.split(":")[0]) for path, text in found.problems()] == [
        (("temperatures", "coil"), "Diag.Heat is multiplexed"),
        (("errors", "station", "Diag.Foreign"), "Diag.Foreign is multiplexed"),
    ]


@pytest.mark.parametrize(("value", "ok"), [(0, False), (1, True), (2, False), (3, False)])
def test_a_range_or_height_outside_the_dbcs_bounds_gives_no_power(
    tmp_path: Path, value: int, ok: bool
) -> None:
    """In two bits, 2 commonly means an error, and 3 not available."""
    found = pads(tmp_path, range_ok="State.InRange", at_height="State.AtHeight")
    values = {"State.Mode": 0, "State.InRange": value, "State.AtHeight": value}
    measured = decode(found, dbc.load(found.dbc), values).measured
    assert (measured.range_ok, measured.at_height) == (ok, value > 0)


def test_a_map_must_say_in_some_way_what_the_state_is() -> None:
    found = msgspec.convert({**MAP, "rules": []}, FrameMap)
    assert list(found.problems()) == [
        (
            ("state",),
            "is missing: give a signal and the meanings of its numbers here, or give rules",
        )
    ]


class TestTheFakeShowsIt(Frames):
    """The contract with a simulated charger that uses the same map as the driver. The driver must read
    the charger's true state."""

    foreign_object = "foreign object"
    settings: ClassVar = {"map": MAP}

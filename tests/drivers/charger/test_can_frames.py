"""The driver for makers' frames: its bytes, its sending pace, and wrong maps.

The tests compare the bytes with frames that the makers have published.
"""

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import msgspec
import pytest

from bridges.kinds.charger import core
from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.signals import (
    Activity,
    ChargeRequested,
    ChargerOutputs,
    ChargerSample,
    Measured,
)
from bridges.kinds.shared.decision import Sampled
from bridges.settings.load import SettingsError, load
from drivers import DriverError
from drivers.charger import dbc
from drivers.charger.can_frames import (
    DRIVER,
    FrameChargerSettings,
    FrameDriver,
    create,
    describe,
    frame_tables,
    warnings,
)
from drivers.charger.can_map import PROFILE, FrameMap
from drivers.hal import can as hal
from drivers.profiles.texts import FOLDER
from tests.drivers.hal.can.far_end import Reactive, failure

EXAMPLE = Path(__file__).parents[3] / "config" / "charger_wiferion.yaml"
SETPOINTS = {"max_volts": 29.4, "volts": 29.2, "amps": 30.0}
OFF, ON, LEFT = (ChargerOutputs(power) for power in (False, True, None))
CONTROL, DISABLE = 0x1806E5F4, 0x1806E6F4
FED = [(CONTROL, "0126012c01240000"), (DISABLE, "0000000000000000")]
KEPT_OFF = [(CONTROL, "0000000000000000"), (DISABLE, "aa00000000000000")]


class Charger:
    """Wiferion's charger in virtual time.

    The charger sends a frame only when the test calls `says`. `got` has the frames from the driver.
    """

    def __init__(self) -> None:
        self.far = Reactive()
        self.far.react = self._hear
        self.got: list[tuple[int, str]] = []
        self.bus = self.far.bus()
        settings = FrameChargerSettings(profile="wiferion", setpoints=SETPOINTS)
        self.driver: FrameDriver = create("c", settings, self.bus)

    def _hear(self, message: can.Message) -> list[can.Message]:
        assert message.is_extended_id
        self.got.append((message.arbitration_id, bytes(message.data).hex()))
        return []

    def says(self, frame_id: int, payload: str) -> None:
        """Send one of the charger's frames."""
        data = bytes.fromhex(payload)
        self.far.coming.append(can.Message(arbitration_id=frame_id, is_extended_id=True, data=data))

    def status(self, state: int = 0) -> None:
        """Send a complete status with this state, without voltage and current."""
        self.says(0x1FFD0101, "0000126700000000")
        self.says(0x18FF50E5, f"00000000000000{state:02x}")

    def scan(self, outputs: ChargerOutputs, for_s: float = 0.05) -> list[tuple[int, str]]:
        """Send a status, read, write, and let `for_s` seconds pass.

        Return the frames that the driver sent, as (id, payload in hexadecimal digits).
        """
        self.status()
        self.driver.read()
        self.driver.write(outputs)
        self.far.now += for_s
        sent, self.got = self.got, []
        return sent


@pytest.fixture
def charger() -> Iterator[Charger]:
    made = Charger()
    made.bus.take()
    made.driver.open()
    yield made
    made.bus.close()


def test_the_driver_stands_on_can_and_has_no_wires() -> None:
    assert DRIVER.buses == ("can",)
    assert list(DRIVER.wires(FrameChargerSettings(profile="wiferion", setpoints=SETPOINTS))) == []


def test_a_published_status_frame_is_what_it_says(charger: Charger) -> None:
    charger.says(0x1FFD0101, "0000126700000000")
    charger.says(0x18FF50E5, "01c8014100000002")  # 456 means 45.6 V, and 321 means 32.1 A
    assert charger.driver.read() == ChargerSample(
        Activity.CHARGING, 2, "", Measured(receiver_id="4711", volts=45.6, amps=32.1)
    )


def test_only_the_low_half_of_the_last_byte_is_the_state(charger: Charger) -> None:
    charger.status(0xF0)
    assert charger.driver.read().activity is Activity.IDLE


def test_published_temperatures_are_scaled() -> None:
    frames = dbc.load("wiferion.dbc")
    found = frames.decode("MobileHeatsink", bytes.fromhex("0000000056000000"))
    assert found == {"HeatsinkTemperature": 24.5}
    found = frames.decode("StationStatus", bytes.fromhex("0000000000005a00"))
    assert found == {"GridVoltage": 230.4}


def test_the_temperatures_of_the_map_are_read_and_one_without_a_reading_is_left_out(
    charger: Charger,
) -> None:
    charger.status()
    charger.says(0x1FFD0102, "0000000056000000")  # 0x56 means 24.5 °C
    charger.says(0x1FFD0103, "00ff000000000000")  # 0xFF means no reading
    assert charger.driver.read().measured.temperatures == (("heatsink", 24.5),)
    charger.status()
    charger.says(0x1FFD0103, "0060000000000000")
    assert charger.driver.read().measured.temperatures == (("heatsink", 24.5), ("coil", 32.0))


def test_height_and_range_are_signals_of_the_map_and_without_them_there_is_no_reading() -> None:
    charger = Charger()
    pad = {"range_ok": "MobileErrors.FanSlow", "at_height": "MobileErrors.GridDerating"}
    found = msgspec.structs.replace(PROFILE.load("wiferion"), **pad)
    charger.driver = create("c", FrameChargerSettings(map=found, setpoints=SETPOINTS), charger.bus)
    charger.bus.take()
    charger.status()
    with pytest.raises(DriverError, match="MobileErrors"):
        charger.driver.read()
    seen = []
    for payload in ("0000000000000000", "0000000000000001", "0000000000000021"):
        charger.status()
        charger.says(0x1FFD0104, payload)
        measured = charger.driver.read().measured
        seen.append((measured.at_height, measured.range_ok))
    assert seen == [(False, False), (False, True), (True, True)]
    charger.bus.close()


@pytest.mark.parametrize(
    ("payload", "side", "text"),
    [
        ("0008000000000000", "robot", "the receiver is too hot"),
        ("0000010000000000", "robot", "the receiver has lost the station"),
        ("0000000100000000", "robot", "the receiver misses the daemon's frames"),
        ("0000000000010000", "station", "the station's supply from the grid is faulty"),
        ("0000000000000100", "station", "the pad is not connected to the station"),
        (
            "0008000000000840",
            "station",
            "the station is too hot; the receiver is too hot",
        ),
        ("0000000000000010", "", ""),  # the daemon's own frames cause this bit: no error
    ],
)
def test_error_bits_name_the_fault_and_its_side(
    charger: Charger, payload: str, side: str, text: str
) -> None:
    charger.says(0x1FFD2304, payload)
    charger.status(8)
    sample = charger.driver.read()
    assert (sample.activity, sample.side, sample.error_text) == (Activity.ERROR, side, text)


def test_an_error_whose_signals_come_after_its_state_has_its_side_from_the_first(
    charger: Charger,
) -> None:
    charger.says(0x1FFD2304, "0000000000000000")
    charger.status(8)
    charger.far.later = [
        can.Message(arbitration_id=0x1FFD2304, data=bytes.fromhex("0008000000000000"))
    ]
    sample = charger.driver.read()
    assert (sample.side, sample.error_text) == ("robot", "the receiver is too hot")


def test_the_signals_of_an_error_are_waited_for_once(charger: Charger) -> None:
    charger.says(0x1FFD2304, "0000000000000000")
    for waits in (True, False, False):
        charger.status(8)
        begun_at = charger.far.now
        assert charger.driver.read().side == ""
        assert (charger.far.now - begun_at > 0.04) == waits


@pytest.mark.parametrize("state", range(16))
@pytest.mark.parametrize(
    ("payload", "side", "text"),
    [
        ("0008000000000000", "robot", "the receiver is too hot"),
        ("0000000000000800", "station", "the station is too hot"),
    ],
)
def test_an_error_bit_is_an_error_whatever_the_state_says(
    charger: Charger, payload: str, side: str, text: str, state: int
) -> None:
    charger.says(0x1FFD2304, payload)
    charger.status(state)
    made = charger.driver.read()
    assert (made.activity, made.side, made.error_text) == (Activity.ERROR, side, text)
    assert made.charges == (state in (1, 2, 3, 4, 5))


def test_a_charger_with_an_error_bit_is_sent_off_and_neither_volts_nor_amps(
    charger: Charger,
) -> None:
    limits, memory = ChargerLimits(), core.initial(ChargerLimits(), 0.0)
    request = ChargeRequested("r1", "tinyRobot", "r1")
    memory = core.decide(memory, Sampled(_idle(charger)), 0.0, limits).memory
    memory = core.decide(memory, request, 0.1, limits).memory
    charger.says(0x1FFD2304, "0000000000000800")
    charger.status(0)
    decision = core.decide(memory, Sampled(charger.driver.read()), 0.2, limits)
    charger.driver.write(decision.outputs)
    assert charger.got == KEPT_OFF
    assert decision.report.error_message == "station: the station is too hot"


def _idle(charger: Charger) -> ChargerSample:
    charger.status(0)
    return charger.driver.read()


def test_a_robot_still_to_come_is_not_an_error_though_its_position_is_not_right(
    charger: Charger,
) -> None:
    charger.says(0x1FFD2304, "0000000000004000")
    charger.status(0)
    idle = charger.driver.read()
    charger.status(8)
    assert [(made.activity, made.side) for made in (idle, charger.driver.read())] == [
        (Activity.IDLE, ""),
        (Activity.ERROR, "robot"),
    ]


def test_bad_positioning_is_out_of_range(charger: Charger) -> None:
    charger.status()
    charger.says(0x1FFD2304, "0000000000004000")
    assert charger.driver.read().measured.in_range is False
    charger.says(0x1FFD2304, "0000000000000000")
    charger.status()
    assert charger.driver.read().measured.in_range is True


# ---- frames that the driver sends, and their pace


def test_power_is_sent_as_the_published_frames_at_their_pace(charger: Charger) -> None:
    sent = [charger.scan(ON) for _ in range(31)]
    assert [n for n, frames in enumerate(sent) if frames] == [0, 10, 20, 30]
    assert [frames for frames in sent if frames] == [FED] * 4


def test_a_change_is_sent_at_once(charger: Charger) -> None:
    levels = [ON, ON, OFF, OFF, ON]
    assert [charger.scan(level) for level in levels] == [FED, [], KEPT_OFF, [], FED]


def test_without_a_wanted_level_nothing_is_sent_until_there_was_one(charger: Charger) -> None:
    assert [charger.scan(LEFT) for _ in range(20)] == [[]] * 20


def test_without_a_wanted_level_the_last_one_is_still_sent(charger: Charger) -> None:
    assert [charger.scan(OFF, 0.5), charger.scan(LEFT, 0.5), charger.scan(LEFT)] == [KEPT_OFF] * 3


def test_a_charger_that_falls_silent_in_a_charge_is_told_to_stop_in_each_period_until_it_is_heard(
    charger: Charger,
) -> None:
    charger.scan(ON)
    charger.far.now += 2
    sent_at = []
    while charger.far.now < 6:
        assert failure(charger.driver.read)
        charger.driver.write(ON if charger.far.now < 4 else LEFT)
        charger.far.now += 0.05
        if charger.got:
            assert charger.got == KEPT_OFF
            sent_at.append(charger.far.now)
            charger.got = []
    gaps_s = [after - before for before, after in itertools.pairwise(sent_at)]
    assert len(gaps_s) >= 6
    assert all(0.4 <= gap_s <= 0.6 for gap_s in gaps_s)
    assert charger.scan(LEFT) == FED


def test_a_charge_that_was_found_is_left_to_itself_when_it_falls_silent(charger: Charger) -> None:
    charger.scan(LEFT)
    charger.far.now += 2
    assert failure(charger.driver.read)
    charger.driver.write(LEFT)
    assert charger.got == []


def test_make_safe_takes_the_power_away(charger: Charger) -> None:
    charger.scan(ON)
    charger.driver.make_safe()
    assert charger.got == KEPT_OFF
    charger.driver.close()
    assert charger.got == KEPT_OFF


def test_closing_takes_away_what_was_given_and_nothing_else(charger: Charger) -> None:
    charger.driver.close()
    assert charger.got == []
    charger.scan(ON)
    charger.driver.close()
    assert charger.got == KEPT_OFF


# ---- a silent charger


def test_without_a_status_frame_there_is_no_state(charger: Charger) -> None:
    charger.scan(OFF)
    charger.far.now += 0.9
    charger.driver.read()
    charger.far.now += 0.2
    assert failure(charger.driver.read) == (
        "no ChargerStatus (0x18FF50E5) at can0 within 1 s: no other frames come on the bus"
        " either: check power, cable, termination and bitrate"
    )


def test_without_its_receiver_there_is_no_reading(charger: Charger) -> None:
    charger.says(0x18FF50E5, "0000000000000000")
    assert failure(charger.driver.read) == (
        "no MobileSerial (0x1FFD0001) at can0 within 5 s: no other frames come on the bus either:"
        " check power, cable, termination and bitrate"
    )


def test_frames_of_another_length_are_named_and_never_read(charger: Charger) -> None:
    charger.says(0x1FFD0101, "0000126700000000")
    charger.says(0x18FF50E5, "000000000005")
    charger.says(0x1FFD0104, "00")
    assert failure(charger.driver.read) == (
        "no ChargerStatus (0x18FF50E5) at can0 within 1 s, but one (0x18FF50E5) of"
        " 6 bytes instead of the map's 8: is the device of another make?"
    )


def test_frames_of_others_are_named(charger: Charger) -> None:
    charger.says(0x18FF50E6, "0000000000000005")
    charger.says(0x1FFE0101, "0000126700000000")
    assert failure(charger.driver.read) == (
        "no ChargerStatus (0x18FF50E5) at can0 within 1 s: the bus works, and other ids are heard:"
        " 0x18FF50E6, 0x1FFE0101"
    )


def test_a_scan_that_cannot_keep_the_pace_is_refused() -> None:
    bus = hal.CanBus(hal.CanSettings(socketcan="can0", scan_s=1.0))
    driver = create("c", FrameChargerSettings(profile="wiferion", setpoints=SETPOINTS), bus)
    assert failure(driver.open) == (
        "ChargerControl must be sent every 0.5 s, and a scan is every 1 s: set the bus's scan_s"
        " to 0.5 or less"
    )


# ---- settings


def problems(**changed: Any) -> list[tuple[tuple[str, ...], str]]:
    made = {"profile": "wiferion", "setpoints": SETPOINTS} | changed
    return list(msgspec.convert(made, FrameChargerSettings).problems())


def test_the_example_is_right_and_says_what_is_untried() -> None:
    texts = " ".join(map(str, load(EXAMPLE).warnings))
    assert "nobody has tried the profile wiferion" in texts
    assert "how long the charger charges without frames" in texts


def test_setpoints_are_those_that_the_map_takes() -> None:
    assert problems() == []
    [(path, text)] = problems(setpoints={"max_volts": 29.4, "volts": 29.2})
    assert (path, text) == (
        ("setpoints",),
        "needs 'amps', which is sent to the charger while it charges",
    )
    [(path, text)] = problems(setpoints=SETPOINTS | {"ampere": 1.0})
    assert (path, text) == (
        ("setpoints", "ampere"),
        "unknown setpoint 'ampere': did you mean 'amps'? known here: amps, max_volts, volts",
    )


@pytest.mark.parametrize("amps", [-1.0, 4000.0])
def test_a_setpoint_that_the_frame_cannot_carry_is_a_problem(amps: float) -> None:
    assert problems(setpoints=SETPOINTS | {"amps": amps}) == [
        (("setpoints", "amps"), f"is {amps:g}: ChargerControl.RefCurrent takes 0 to 3276.7 A")
    ]


def test_volts_above_their_own_maximum_are_a_problem() -> None:
    assert problems(setpoints=SETPOINTS | {"volts": 29.5}) == [
        (("setpoints", "volts"), "is 29.5, above max_volts, which is 29.4")
    ]


def test_a_charge_that_must_be_fed_cannot_be_kept_after_the_daemons_end() -> None:
    [(path, _)] = problems(on_death="keep")
    assert path == ("on_death",)


def test_a_map_or_a_profile_is_needed_and_not_both() -> None:
    [(path, _)] = problems(profile=None)
    assert path == ("profile",)
    plain = msgspec.to_builtins(PROFILE.load("wiferion"))
    [(path, _)] = problems(map=plain)
    assert path == ("profile",)
    assert problems(profile=None, map=plain) == []


def map_problems(**changed: Any) -> list[tuple[tuple[str, ...], str]]:
    plain = msgspec.to_builtins(PROFILE.load("wiferion")) | changed
    return list(msgspec.convert(plain, FrameMap).problems())


@pytest.mark.parametrize(
    ("changed", "path", "text"),
    [
        ({"dbc": "other.dbc"}, ("dbc",), "No such file or directory"),
        ({"dbc": "wiferion.yaml"}, ("dbc",), "is not a DBC file"),
        ({"volts": "ChargerStatus.Voltage"}, ("volts",), "'OutputVoltage'"),
        ({"amps": "ChargeStatus.Amps"}, ("amps",), "'ChargerStatus'"),
        ({"masks": {"Mobile": 1}}, ("masks", "Mobile"), "unknown frame 'Mobile'"),
        (
            {"send": [{"frame": "Control", "every_s": 1, "on": {}}]},
            ("send", "0", "frame"),
            "unknown frame 'Control'",
        ),
        (
            {"send": [{"frame": "DisableCharging", "every_s": 1, "off": {"Sign": 1}}]},
            ("send", "0", "off", "Sign"),
            "'Signature'",
        ),
    ],
)
def test_a_map_that_contradicts_its_dbc_file_is_a_problem_at_its_place(
    changed: dict[str, Any], path: tuple[str, ...], text: str
) -> None:
    found = map_problems(**changed)
    assert [p for p, t in found if text in t] == [path]


def test_a_frame_that_is_never_sent_is_a_problem() -> None:
    sent = [{"frame": "DisableCharging", "every_s": 1}]
    made = msgspec.convert(msgspec.to_builtins(PROFILE.load("wiferion")) | {"send": sent}, FrameMap)
    assert list(made.send[0].problems()) == [((), "is never sent: give on, or off, or both")]


def test_a_map_in_the_yaml_is_read_like_a_profile(tmp_path: Path) -> None:
    text = EXAMPLE.read_text("utf-8")
    profile = (FOLDER / "wiferion.yaml").read_text("utf-8")
    inline = profile[profile.index("map:") :].replace("\n", "\n    ")
    file = tmp_path / "charger.yaml"
    file.write_text(text.replace("profile: wiferion", inline.rstrip()), "utf-8")
    assert load(file).devices["charger_c"].map == PROFILE.load("wiferion")
    file.write_text(
        text.replace("profile: wiferion", inline.rstrip()).replace("wiferion.dbc", "x.dbc"), "utf-8"
    )
    with pytest.raises(SettingsError) as caught:
        load(file)
    assert "x.dbc cannot be read" in str(caught.value.problems[0])


def test_two_chargers_that_send_the_same_frames_need_two_buses(tmp_path: Path) -> None:
    text = EXAMPLE.read_text("utf-8")
    device = text[text.index("  charger_c:") :]
    file = tmp_path / "two.yaml"
    file.write_text(text + device.replace("charger_c", "charger_d"), "utf-8")
    with pytest.raises(SettingsError) as caught:
        load(file)
    taken = [
        f"frame {frame} is used by charger_c profile" for frame in ("0x18FF50E5", "0x1806E5F4")
    ]
    assert all(text in str(caught.value) for text in taken)


def test_check_prints_frames_bytes_and_meanings() -> None:
    settings = FrameChargerSettings(profile="wiferion", setpoints=SETPOINTS)
    rows = describe(settings, hal.CanSettings(socketcan="can0"))
    assert ("state", "ChargerStatus.ChargerState (0x18FF50E5)") in rows
    assert ("state charging", "1, 2, 3, 4, 5") in rows
    sent, read = frame_tables(settings)
    control, disable = ("ChargerControl", "0x1806E5F4"), ("DisableCharging", "0x1806E6F4")
    volts = "MaxVoltage 29.4 V, RefCurrent 30 A, RefVoltage 29.2 V"
    none = "MaxVoltage 0 V, RefCurrent 0 A, RefVoltage 0 V"
    assert sent.rows == (
        (*control, "power on", "0.5 s", "01 26 01 2C 01 24 00 00", volts),
        (*control, "power off", "0.5 s", "00 00 00 00 00 00 00 00", none),
        (*disable, "power on", "0.5 s", "00 00 00 00 00 00 00 00", "Signature 0"),
        (*disable, "power off", "0.5 s", "AA 00 00 00 00 00 00 00", "Signature 170"),
    )
    status = ("ChargerStatus", "0x18FF50E5")
    assert read.rows[2] == (*status, "00 00 00 00 00 00 00 01", "ChargerState 1: charging")
    assert read.rows[9:11] == (
        (*status, "01 02 00 00 00 00 00 00", "OutputVoltage 25.8 V"),
        (*status, "00 00 00 81 00 00 00 00", "OutputCurrent 12.9 A"),
    )


def test_a_map_without_a_receiver_verifies_nobody() -> None:
    plain = msgspec.to_builtins(PROFILE.load("wiferion")) | {"receiver": None}
    limits = {"peer_internal_timeout_s": 2}
    made = {"map": plain, "setpoints": SETPOINTS, "receivers": {"7": "tiny/r1"}, "limits": limits}
    assert [path for path, _ in warnings(msgspec.convert(made, FrameChargerSettings))] == [
        ("receivers",)
    ]


# ---- DBC files


@pytest.mark.parametrize(
    "text", ["", "hello", 'VERSION ""\nBO_ 1 A: 8 X\n SG_ B : 0|99@1+ (1,0) [0|1] "" X\n']
)
def test_a_file_that_is_not_a_dbc_file_is_a_value_error_on_one_line(text: str) -> None:
    with pytest.raises(ValueError, match="is not a DBC file") as caught:
        dbc.Dbc(text)
    assert "\n" not in str(caught.value)

"""The simulated HTTP charger, which is a real server. The real driver reads from this server in each of
the server's failures."""

import contextlib
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample
from bridges.settings.load import Config, load
from drivers import DriverError
from drivers.charger.http import create
from drivers.charger.state_codes import Codes
from drivers.hal.http import HttpBus
from hal_fakes.fake import plants_on, stations_on
from hal_fakes.http import HttpServer, serve
from hal_fakes.http_charger import FakeHttpCharger as Station
from hal_fakes.plants.charger import ChargerPlant, Reading
from hal_fakes.plants.plant import FailureMode
from hal_fakes.realtime import RealTime
from tests.waiting import at_last, wait_until

EXAMPLE = Path(__file__).parents[4] / "config" / "charger_http.yaml"
IDLE = ChargerSample(Activity.IDLE, 0)


class Fake:
    """The example's station with its server, bus and driver. The bus does not pause after a failure."""

    def __init__(self, config: Config, timeout_s: float) -> None:
        settings = msgspec.structs.replace(config.buses["tpu"], timeout_s=timeout_s)
        self.world = RealTime(plants_on(config, "tpu"))
        self.plant = self.world.plants["charger_a"]
        self.server: HttpServer = serve(settings, stations_on(config, "tpu", self.world.plants))
        pointed = msgspec.structs.replace(settings, **self.server.replace)
        calls = iter(range(10**6))
        self.bus = HttpBus(pointed, clock=lambda: 1000.0 * next(calls))
        self.driver = create("charger_a", config.devices["charger_a"], self.bus)

    def press(self, signal: str, asserted: bool) -> None:
        self.plant.press(signal, asserted, time.monotonic())

    def read_until(self, activity: Activity) -> set[int | str]:
        """Read until the station shows this activity. Return all codes that the station has shown."""
        seen: set[int | str] = set()

        def says_so() -> bool:
            sample = self.driver.read()
            seen.add(sample.code)
            return sample.activity is activity

        wait_until(says_so, f"the station is {activity}")
        return seen


@contextlib.contextmanager
def fake(timeout_s: float = 5.0, **device: Any) -> Iterator[Fake]:
    config = load(EXAMPLE)
    changed = msgspec.structs.replace(config.devices["charger_a"], **device)
    config.devices["charger_a"] = changed  # type: ignore[index]
    made = Fake(config, timeout_s)
    yield made
    made.bus.close()
    made.server.close()
    made.server.close()
    made.world.close()


def test_the_station_is_read_in_the_makers_numbers_through_a_whole_charge() -> None:
    with fake() as it:
        assert it.driver.read() == IDLE
        it.press("robot", True)
        assert 5 in it.read_until(Activity.CHARGING) <= {1, 2, 3, 4, 9, 10, 5}
        it.press("robot", False)
        assert 0 in it.read_until(Activity.IDLE) <= {7, 0}


def test_an_error_is_read_with_its_text_and_cleared() -> None:
    with fake() as it:
        it.press("foreign_object", True)
        it.press("robot", True)
        assert it.driver.read() == ChargerSample(Activity.ERROR, 8, "foreign object detected")
        it.press("robot", False)
        it.press("foreign_object", False)
        it.driver.write(ChargerOutputs(clear_errors=1))
        assert it.driver.read() == IDLE


def test_a_maker_with_few_numbers_shows_the_nearest() -> None:
    with fake(codes=Codes(idle=[3], charging=[4])) as it:
        it.press("robot", True)
        assert 4 in it.read_until(Activity.CHARGING) <= {3, 4}
        it.press("foreign_object", True)
        assert it.driver.read() == ChargerSample(Activity.ERROR, 100, "foreign object detected")


@pytest.mark.parametrize(
    ("progress", "code"), [(0.0, 1), (0.16, 1), (0.17, 2), (0.5, 4), (0.99, 10), (1.0, 10)]
)
def test_the_numbers_of_a_handshake_follow_one_another(progress: float, code: int) -> None:
    station = Station(ChargerPlant("a"), load(EXAMPLE).devices["charger_a"])
    reading = Reading(Activity.HANDSHAKE, progress)
    assert json.loads(station.body(reading)) == {"state": code, "error_msg": ""}


def test_a_path_that_does_not_exist_is_not_found() -> None:
    with fake() as it:
        with pytest.raises(DriverError, match="status 404"):
            it.bus.get_json("/nowhere")
        with pytest.raises(DriverError, match="status 404"):
            it.bus.send("/nowhere")


ANSWERED = [
    ("server", "off", "no complete HTTP answer"),
    ("server", "garbage", "answered text/html instead of JSON"),
    ("server", "wrong", "'state' is '0', and a whole number is expected"),
    ("headers", "off", "answered no content type"),
    ("headers", "garbage", "no complete HTTP answer"),
    ("headers", "wrong", "answered status 500"),
    ("body", "off", "answered invalid JSON"),
    ("body", "garbage", "answered invalid JSON"),
]
ENDLESS = [
    ("server", "slow"),
    ("headers", "stuck"),
    ("headers", "slow"),
    ("body", "stuck"),
    ("body", "slow"),
]


@pytest.mark.parametrize(("part", "mode", "text"), ANSWERED)
def test_a_bad_answer_is_an_error_and_mending_the_server_is_enough(
    part: str, mode: FailureMode, text: str
) -> None:
    with fake() as it:
        assert it.driver.read() == IDLE
        it.plant.fail(part, mode)
        with pytest.raises(DriverError, match=text):
            it.driver.read()
        it.plant.fail(part, None)
        assert it.driver.read() == IDLE


@pytest.mark.parametrize(("part", "mode"), ENDLESS)
def test_an_answer_that_does_not_end_in_time_is_an_error_and_mending_is_enough(
    part: str, mode: FailureMode
) -> None:
    with fake(timeout_s=0.4) as it:
        it.plant.fail(part, mode)
        with pytest.raises(DriverError, match="no complete answer within"):
            it.driver.read()
        it.plant.fail(part, None)
        assert at_last(it.driver.read, "the driver reads an answer after the failure") == IDLE


def test_a_number_that_is_in_no_list_is_unknown() -> None:
    with fake() as it:
        it.plant.fail("body", "wrong")
        assert it.driver.read() == ChargerSample(Activity.UNKNOWN, 100)


def test_a_server_that_is_stuck_repeats_its_last_answer() -> None:
    with fake() as it:
        it.plant.fail("server", "stuck")
        assert it.driver.read() == IDLE
        it.press("over_temperature", True)
        it.press("robot", True)
        assert it.driver.read() == IDLE
        it.plant.fail("server", None)
        assert it.driver.read() == ChargerSample(Activity.ERROR, 8, "over temperature")


@pytest.mark.parametrize("mode", ["off", "stuck"])
def test_a_station_whose_server_fails_does_not_hear_that_its_error_is_cleared(
    mode: FailureMode,
) -> None:
    with fake() as it:
        it.plant.fail("server", mode)
        with contextlib.suppress(DriverError):
            it.driver.write(ChargerOutputs(clear_errors=1))
        assert it.plant.edges == []

"""A door behind a relay that answers HTTP: the contract, the relay's timer, and the YAML."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import msgspec
import pytest

from bridges.kinds.door.signals import DoorOutputs
from bridges.settings.load import load
from drivers import DriverError
from drivers.door import http as door_http
from drivers.door.http import HttpDoorSettings, create, decode
from drivers.hal import HalError, http
from drivers.json_fields import JsonFlag
from hal_fakes.http_door import FakeHttpDoor
from hal_fakes.http_flags import PARTS, contacts, flags
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.plant import FailureMode
from hal_fakes.realtime import RealTime
from tests.drivers.benches import on_http
from tests.drivers.door.contract import CLOSED, HOLD, OPEN, QUICK, RELEASE, Bench, WiredDoorContract
from tests.settings.reading import changed, texts_of
from tests.waiting import wait_until

EXAMPLE = Path(__file__).parents[3] / "config" / "door_http.yaml"
SETTINGS: HttpDoorSettings = load(EXAMPLE).devices["side_door"]
ON = "GET /rpc/Switch.Set?id=0&on=true&toggle_after=10"
OFF = "GET /rpc/Switch.Set?id=0&on=false"


class HttpContract(WiredDoorContract):
    settings: ClassVar = SETTINGS

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        plant = DoorPlant(
            "door", contacts(flags(self.settings.inputs), door_http.HOLD), parts=PARTS, **QUICK
        )
        world = RealTime({"door": plant})
        station = FakeHttpDoor(world.plants["door"], self.settings)
        with on_http(world, station, timeout_s=0.3) as (bus, clock):
            yield Bench(create("door", self.settings, bus), station.plant, clock)

    @pytest.mark.parametrize("part", ["server", "headers"])
    def test_a_link_that_is_gone_is_a_driver_error_and_a_hold_survives_it(
        self, bench: Bench, part: str
    ) -> None:
        super().test_a_link_that_is_gone_is_a_driver_error_and_a_hold_survives_it(bench, part)

    @pytest.mark.parametrize("mode", ["garbage", "wrong", "slow"])
    def test_every_failure_is_a_driver_error_and_never_reads_as_open(
        self, bench: Bench, mode: FailureMode
    ) -> None:
        super().test_every_failure_is_a_driver_error_and_never_reads_as_open(bench, mode)


class TestARelayWithATimer(HttpContract):
    pass


class TestARelayThatSaysNumbersAndWordsAndHasNoTimer(HttpContract):
    settings: ClassVar = msgspec.convert(
        {
            "state_path": "/status",
            "inputs": {
                "opened": {"field": "inputs.open", "when": [1]},
                "closed": {"field": "inputs.closed", "when": ["on", 0.5]},
            },
            "hold": {"path": "/relay/0?turn=on", "method": "GET"},
            "release": {"path": "/relay/0", "body": '{"turn": "off"}'},
            "accept_unsafe": {"hold_open": "the operator lets go by itself after a minute"},
        },
        HttpDoorSettings,
    )


class TestAShortTimer(HttpContract):
    settings: ClassVar = msgspec.structs.replace(SETTINGS, switches_off_after_s=1.0)

    def test_a_relay_that_is_not_told_again_lets_the_door_go_by_itself(self, bench: Bench) -> None:
        bench.driver.open()
        bench.driver.write(HOLD)
        wait_until(lambda: bench.ends() == OPEN, "the held door reads open")
        wait_until(
            lambda: bench.ends() == CLOSED,
            "the relay lets the door go when nobody repeats the command",
        )
        assert bench.relay() == [True, False]


class Relay:
    """A bus to a relay with two inputs. The test sets the inputs and the relay's state `held`."""

    def __init__(self, opened: Any = False, held: Any = False) -> None:
        self.inputs, self.held = [opened, not opened], held
        self.calls: list[str] = []
        self.fails = False

    def get_json(self, path: str) -> dict[str, Any]:
        opened, closed = self.inputs
        held = {"switch:0": {"output": self.held}}
        return {"input:0": {"state": opened}, "input:1": {"state": closed}, **held}

    def send(
        self, path: str, method: str = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        self.calls.append(f"{method} {path}")
        if self.fails:
            raise HalError("the answer is lost")

    def insist(self) -> None:
        self.calls.append("insist")


def test_a_hold_is_renewed_in_each_scan_and_a_release_is_sent_once() -> None:
    relay = Relay(held=False)
    door = create("door", SETTINGS, relay)
    door.open()
    for outputs in (RELEASE, HOLD, HOLD, HOLD, RELEASE, RELEASE):
        door.read()
        door.write(outputs)
        relay.held = outputs.hold_open
    assert relay.calls == [OFF, ON, ON, ON, OFF]


def test_a_start_releases_a_door_whose_state_cannot_be_read_and_later_one_does_not() -> None:
    relay = Relay(held=None)
    door = create("door", SETTINGS, relay)
    for _ in range(2):
        with pytest.raises(DriverError):
            door.open()
    relay.held = False
    door.open()
    relay.held = None
    with pytest.raises(DriverError):
        door.open()
    assert relay.calls == [OFF, OFF]


def test_a_release_that_was_not_obeyed_or_heard_is_sent_again() -> None:
    relay = Relay(held=True)
    door = create("door", SETTINGS, relay)
    door.open()
    door.read()
    door.write(RELEASE)
    relay.held, relay.fails = False, True
    door.read()
    with pytest.raises(DriverError):
        door.write(HOLD)
    relay.fails = False
    door.read()
    door.write(RELEASE)
    assert relay.calls == [OFF, OFF, ON, OFF]


def test_a_relay_that_stays_on_is_reported_at_the_end() -> None:
    relay = Relay(held=True)
    door = create("door", SETTINGS, relay)
    with pytest.raises(DriverError, match="still on after it was switched off"):
        door.make_safe()


def test_an_input_that_is_neither_yes_nor_no_gives_no_reading() -> None:
    values: tuple[Any, ...] = (1, "true", 0.5, [])
    for value in values:
        with pytest.raises(DriverError, match=r"'input:0\.state' is .* true or false is expected"):
            create("door", SETTINGS, Relay(opened=value)).read()


@pytest.mark.parametrize("signal", ["opened", "closed", "obstruction", "fire"])
def test_an_input_that_is_null_gives_no_reading(signal: str) -> None:
    """A reading with two unknown end positions would mean that the door moves."""
    inputs = msgspec.structs.replace(SETTINGS.inputs, **{signal: JsonFlag(field="it")})
    settings = msgspec.structs.replace(SETTINGS, inputs=inputs)
    answer = Relay().get_json("")
    assert getattr(decode(settings, {**answer, "it": True}), signal) is True
    with pytest.raises(DriverError, match="'it' is null, and yes or no is expected"):
        decode(settings, {**answer, "it": None})


WRONG = {
    "    switches_off_after_s: 10 ": (
        "",
        "unsafe: when the network dies nothing releases the door: let hold set the relay's"
        " own timer, and write the timer's time as switches_off_after_s;"
        " or accept_unsafe: {hold_open: <why it is safe here>}",
    ),
    "switches_off_after_s: 10 ": (
        "switches_off_after_s: 3 ",
        "switches_off_after_s is 3, but it is renewed every 1 s (scan_s): write at least 4, so"
        " that one lost reply does not switch off the output",
    ),
    '      closed: {field: "input:1.state"} ': (
        "",
        "'inputs' needs 'closed'; if the door has no such input, write feedback: estimated",
    ),
    "on=false": ("on=true&toggle_after=10", "'release' is the same command as hold"),
}


@pytest.mark.parametrize("old", WRONG)
def test_what_would_leave_a_door_held_or_unseen_is_refused(tmp_path: Path, old: str) -> None:
    new, wanted = WRONG[old]
    found = texts_of(tmp_path / "door.yaml", changed(old, new, EXAMPLE.read_text()))
    assert found == [wanted]


def test_a_relay_without_a_timer_is_taken_with_a_reason(tmp_path: Path) -> None:
    text = EXAMPLE.read_text().replace("    switches_off_after_s: 10 ", "   ")
    file = tmp_path / "door.yaml"
    file.write_text(f"{text}    accept_unsafe: {{hold_open: the operator ends it}}\n")
    warnings = [w.text for w in load(file).warnings]
    accepted = (
        "warning: 'side_door': unsafe wiring of 'hold_open' is accepted: the operator ends it"
    )
    assert warnings == [accepted]


def test_check_says_that_nothing_closes_the_door() -> None:
    rows = dict(door_http.describe(SETTINGS, http.HttpSettings(api_base="relay")))
    assert rows["closing"].startswith("not commanded: a released door stays open unless")
    assert DoorOutputs.__struct_fields__ == ("hold_open", "between_pulses")

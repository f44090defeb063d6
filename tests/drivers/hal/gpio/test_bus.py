"""The GPIO bus on gpiozero's mock pins. Behind the pins are contacts and relays without physics."""

from collections.abc import Iterator, Sequence

import pytest

from drivers.hal.gpio import GpioBus, GpioSettings, canonical, open_bus
from drivers.hal.points import HalError, Points, Wire
from hal_fakes.gpio import WiredFactory
from hal_fakes.plants.machine import WiredPlant
from hal_fakes.wiring import PlantWiring

WIRES = (
    Wire("alarm", "in", "J8:7", "low", "down"),
    Wire("open", "in", "BCM2", "high", "up"),
    Wire("call", "out", "BCM18", "high"),
    Wire("hold", "out", "BCM7", "low"),
)


class Contacts(WiredPlant):
    """A simulated device without physics."""

    def __init__(self, wires: Sequence[Wire] = WIRES) -> None:
        super().__init__("plant", wires, buttons=[wire.signal for wire in wires])

    def contact(self, signal: str) -> bool:
        return self.pressed[signal]

    def run(self) -> None:
        pass

    def event_at(self) -> float:
        return float("inf")


class Bench:
    """A header with a simulated device. Both measure time with `now`."""

    def __init__(self) -> None:
        self.now = 0.0
        self.plant = Contacts()
        self.factory = WiredFactory(
            [PlantWiring(self.plant, WIRES, canonical)], clock=lambda: self.now
        )
        self.bus: GpioBus = open_bus(GpioSettings(), self.factory, clock=lambda: self.now)
        self.points = Points(WIRES, self.bus)

    def relays(self) -> list[tuple[str, object]]:
        return [(e.signal, e.value) for e in self.plant.edges if e.what == "relay"]

    def press(self, signal: str, on: bool) -> None:
        self.plant.press(signal, on, self.now)
        self.factory.show(self.now)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.points.close()
    made.bus.close()


def test_claiming_and_closing_move_no_relay(bench: Bench) -> None:
    bench.points.open()
    bench.points.close()
    bench.bus.close()
    assert bench.relays() == []


def test_an_active_low_output_is_high_from_the_first_moment(bench: Bench) -> None:
    bench.points.open()
    states = {p.point: [bool(s.state) for s in p.states] for p in bench.factory.pins.values()}
    assert states == {"BCM4": [True], "BCM2": [False], "BCM18": [False], "BCM7": [True]}


def test_outputs_reach_their_relays_and_contacts_their_signals(bench: Bench) -> None:
    bench.points.open()
    bench.points.write({"call": True, "hold": True})
    bench.points.write({"call": False, "hold": True})
    bench.press("alarm", True)
    assert (bench.relays(), bench.points.read()) == (
        [("call", True), ("hold", True), ("call", False)],
        {"alarm": True, "open": False},
    )


def test_what_is_on_goes_off_when_the_points_are_let_go(bench: Bench) -> None:
    bench.points.open()
    bench.points.write({"call": True, "hold": True})
    bench.points.close()
    assert bench.relays()[2:] == [("call", False), ("hold", False)]


def test_an_edge_wakes_once_and_the_level_is_there(bench: Bench) -> None:
    woken = []
    bench.bus.on_edge(lambda: woken.append(bench.points.read()))
    bench.points.open()
    bench.press("open", True)
    bench.press("open", True)
    assert woken == [{"alarm": False, "open": True}]


def test_a_pin_claimed_twice_is_refused_and_the_holder_keeps_it(bench: Bench) -> None:
    bench.points.open()
    second = bench.bus.lines({"BCM4": "down"}, {"BCM23": False})
    with pytest.raises(HalError) as refused:
        second.claim()
    assert str(refused.value) == (
        "BCM4 = J8:7: pin GPIO4 is already in use by another device of this daemon"
        " (BCM18, BCM7, BCM4, BCM2)"
    )
    assert bench.points.read() == {"alarm": False, "open": False}
    bench.points.close()
    second.claim()
    assert second.read() == {"BCM4": True}


def test_another_pull_than_the_fixed_one_is_refused(bench: Bench) -> None:
    with pytest.raises(HalError, match=r"^BCM3 = J8:5: GPIO3 has a fixed pull resistor$"):
        bench.bus.lines({"BCM3": "down"}, {}).claim()


def test_an_output_does_not_become_an_input_while_it_is_held(bench: Bench) -> None:
    from gpiozero import PinInvalidFunction

    bench.points.open()
    pin = bench.factory.pin("BCM18")
    with pytest.raises(PinInvalidFunction, match="BCM18 is an output"):
        pin.input_with_pull("down")


def test_a_pin_to_which_nothing_is_wired_reads_its_pull(bench: Bench) -> None:
    lines = bench.bus.lines({"BCM20": "up", "BCM21": "down"}, {})
    lines.claim()
    assert lines.read() == {"BCM20": True, "BCM21": False}


def test_making_safe_reads_back_what_the_pins_have(bench: Bench) -> None:
    bench.points.open()
    bench.points.write({"call": True, "hold": True})
    bench.points.make_safe()
    assert bench.relays()[2:] == [("call", False), ("hold", False)]


def test_a_bus_that_is_closed_can_neither_read_nor_write(bench: Bench) -> None:
    bench.points.open()
    bench.bus.close()
    for broken in (bench.points.read, lambda: bench.points.write({"call": True})):
        with pytest.raises(HalError, match="is not claimed"):
            broken()

"""The times at which `rmf-bridge walk` switches an output on and off, in virtual time."""

from dataclasses import dataclass

from workbench.commissioning.walk.core import (
    ON_S,
    ByEye,
    Event,
    InputsLost,
    InputsRead,
    Switch,
    Tick,
    WalkMemory,
    WalkStep,
    decide,
    output_of,
)


@dataclass(frozen=True)
class Sample:
    fire: bool = False
    open: bool = False


def _fire(sample: Sample) -> str:
    return "fire" if sample.fire else ""


STEPS = [
    WalkStep("hold", "holds the door", "hold on", "the door is open", lambda s: s.open, _fire),
    WalkStep("lamp", "lights a lamp", "lamp on", "the lamp is lit", None, _fire),
]


class Walk:
    """A run of `rmf-bridge walk` that reads its inputs every 0.1 s. If `sample` is None, there is no
    reading."""

    def __init__(self) -> None:
        self.now = 0.0
        self.memory = WalkMemory()
        self.sample: Sample | None = Sample()
        self.history: list[tuple[float, str]] = []
        self.until(0.1)

    def does(self, event: Event) -> None:
        self.memory = decide(self.memory, event, self.now, STEPS)
        output = output_of(self.memory, STEPS) or "off"
        if not self.history or self.history[-1][1] != output:
            self.history.append((round(self.now, 1), output))

    def until(self, at: float) -> None:
        while self.now < at:
            self.now = round(self.now + 0.1, 1)
            self.does(Tick() if self.sample is None else InputsRead(self.sample))


def test_an_output_goes_off_by_itself() -> None:
    walk = Walk()
    walk.until(1.0)
    walk.does(Switch(0))
    walk.until(20.0)
    assert walk.history == [(0.1, "off"), (1.0, "hold on"), (1.0 + ON_S, "off")]
    assert walk.memory.says == "hold was on for 5 s"


def test_the_same_key_switches_it_off_and_never_two_are_on() -> None:
    walk = Walk()
    walk.does(Switch(0))
    walk.until(1.0)
    walk.does(Switch(1))
    walk.until(2.0)
    walk.does(Switch(1))
    walk.until(3.0)
    assert walk.history[:3] == [(0.1, "off"), (0.1, "hold on"), (1.0, "off")]
    assert walk.history[3:] == [(2.0, "lamp on")]


def test_without_a_reading_nothing_is_switched_on() -> None:
    walk = Walk()
    walk.does(InputsLost("no reply"))
    walk.does(Switch(0))
    assert walk.history == [(0.1, "off")]
    assert walk.memory.says == "hold stays off: no reply"


def test_a_reading_that_fails_or_grows_old_switches_it_off() -> None:
    lost, old = Walk(), Walk()
    for walk in (lost, old):
        walk.does(Switch(0))
        walk.until(1.0)
    lost.does(InputsLost("no reply"))
    old.sample = None
    old.until(3.0)
    assert lost.history[-1] == (1.0, "off")
    assert old.history[-1] == (2.1, "off")


def test_a_hazard_keeps_it_off_and_switches_it_off() -> None:
    walk = Walk()
    walk.does(Switch(0))
    walk.until(1.0)
    walk.sample = Sample(fire=True)
    walk.until(2.0)
    walk.does(Switch(1))
    walk.until(3.0)
    assert walk.history == [(0.1, "off"), (0.1, "hold on"), (1.1, "off")]
    assert walk.memory.says == "lamp stays off: fire"


def test_feedback_counts_also_after_the_output_has_gone_off() -> None:
    walk = Walk()
    walk.does(Switch(0))
    assert walk.memory.results == {0: "switched on, and nothing was seen"}
    walk.until(30.0)
    walk.sample = Sample(open=True)
    walk.until(31.0)
    assert walk.memory.results == {0: "seen: the door is open"}


def test_an_output_that_no_input_shows_is_confirmed_by_eye() -> None:
    walk = Walk()
    walk.does(Switch(1))
    walk.until(6.0)
    walk.does(ByEye(1, True))
    walk.does(ByEye(0, False))
    assert walk.memory.results == {1: "seen, by eye", 0: "not seen, by eye"}


def test_what_was_seen_before_it_was_switched_on_proves_nothing() -> None:
    walk = Walk()
    walk.sample = Sample(open=True)
    walk.until(0.5)
    walk.does(Switch(0))
    walk.until(6.0)
    assert walk.history == [(0.1, "off"), (0.5, "hold on"), (5.5, "off")]
    told = "switched on; the inputs had shown the effect before, so the test proves nothing"
    assert walk.memory.results == {0: told}
    walk.sample = Sample()
    walk.until(7.0)
    walk.does(Switch(0))
    walk.sample = Sample(open=True)
    walk.until(7.5)
    assert walk.memory.results == {0: "seen: the door is open"}

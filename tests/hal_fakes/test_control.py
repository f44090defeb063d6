"""The control socket of a running simulation."""

import socket
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest

from drivers.hal import HalError
from hal_fakes.caller import Caller
from hal_fakes.control import Control
from hal_fakes.plants.lift import LiftPace, LiftPlant
from hal_fakes.plants.plant import Edge
from hal_fakes.realtime import RealTime
from tests.hal_fakes.virtual_lift import shipped

QUICK = LiftPace(floor_s=0.02, door_s=0.02, agv_s=0.02, dwell_s=0.02)


class World:
    """A running lift with its control socket."""

    def __init__(self, path: Path) -> None:
        self.lift = LiftPlant("Lift1", shipped(), QUICK)
        self.running = RealTime({"Lift1": self.lift})
        self.control = Control(path, self.running.plants)
        self.callers: list[Caller] = []

    def call(self) -> Caller:
        self.callers.append(Caller(self.control.path))
        return self.callers[-1]


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    made = World(tmp_path / "plant.sock")
    yield made
    for caller in made.callers:
        caller.close()
    made.control.close()
    made.running.close()


def test_a_follower_hears_every_later_edge(world: World) -> None:
    caller = world.call()
    assert caller.say("follow") == "ok"
    before = time.monotonic()
    world.running.plants["Lift1"].drive("agv_mode_request", True, before)
    edges = list(islice(caller.edges(), 2))
    assert [replace(edge, at=0.0) for edge in edges] == [
        Edge(0.0, "Lift1", "relay", "agv_mode_request", True),
        Edge(0.0, "Lift1", "sensor", "agv_mode", True),
    ]
    assert [edge.at for edge in edges] == pytest.approx([before, before + QUICK.agv_s])


def test_commands_press_signals_and_break_parts(world: World) -> None:
    caller = world.call()
    assert caller.say("press Lift1 fire_alarm on") == "ok"
    assert world.running.plants["Lift1"].sense("fire_alarm")
    assert caller.say("press Lift1 fire_alarm off") == "ok"
    assert not world.running.plants["Lift1"].sense("fire_alarm")
    assert caller.say("fail Lift1 fire_alarm off") == "ok"
    assert world.running.plants["Lift1"].sense("fire_alarm")
    assert caller.say("fail Lift1 fire_alarm ok") == "ok"
    assert not world.running.plants["Lift1"].sense("fire_alarm")


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("press Lift2 fire_alarm on", "error no device 'Lift2'; there are Lift1"),
        (
            "press Lift1 fire on",
            "error Lift1 has no 'fire' to press; there are fire_alarm, code_blue, hall_L1, hall_L2,"
            " hall_L3, hall_L4, obstruction",
        ),
        (
            "fail Lift1 door odd",
            "error no failure 'odd'; there are off, stuck, slow, garbage, wrong",
        ),
        ("press 'Lift1 fire_alarm on", "error No closing quotation"),
        *(
            (
                line,
                "error not understood; write: follow | names | fail DEVICE PART"
                " off|stuck|slow|garbage|wrong|ok | press DEVICE SIGNAL on|off",
            )
            for line in ("", "press Lift1 fire_alarm yes", "follow me", "\x00\xff")
        ),
    ],
)
def test_an_impossible_command_is_answered_with_the_reason(
    world: World, line: str, answer: str
) -> None:
    assert world.call().say(line) == answer


def test_a_caller_that_leaves_or_never_reads_does_not_stop_the_plants(world: World) -> None:
    gone, deaf, well = world.call(), world.call(), world.call()
    assert (gone.say("follow"), deaf.say("follow"), well.say("follow")) == ("ok", "ok", "ok")
    gone.close()
    world.callers.remove(gone)
    plant = world.running.plants["Lift1"]
    told = 0
    while told < 2000:  # far fewer edges fill the socket of a caller that does not read
        for i in range(50):
            plant.drive("door_open", i % 2 == 0, time.monotonic())
        told += len(list(islice(well.edges(), 50)))
    assert len(list(iter(deaf.hear, ""))) < told


def test_closing_hangs_up_and_removes_the_socket(world: World) -> None:
    caller = world.call()
    caller.say("follow")
    world.control.close()
    world.control.close()
    assert (caller.hear(), world.control.path.exists()) == ("", False)


def test_a_socket_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    path = tmp_path / "no such directory" / "plant.sock"
    with pytest.raises(HalError, match=f"^cannot make the plant's control socket {path}: "):
        Control(path, {})


def test_the_socket_of_a_dead_daemon_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "plant.sock"
    left = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    left.bind(str(path))
    left.close()
    control = Control(path, {})
    caller = Caller(path)
    assert caller.say("follow") == "ok"
    caller.close()
    control.close()

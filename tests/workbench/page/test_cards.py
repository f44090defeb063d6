"""The scripts that the page sends to a browser. In each turn of its loop, the page sends all
changes in one script. Without a change the page sends no script."""

import json

from msgspec.structs import replace

from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.transports.transport import Transport, TransportError
from tests.workbench.page.test_live_site import LIFT, WALL, lift
from workbench.page.cards import Cards, place_of, script
from workbench.page.listener import Listener
from workbench.page.live_site import LiveSite

HOSTILE = "</script>\u2028\"'`${1}"


class Wall:
    """A stand-in for a browser's view that stores the scripts from the page."""

    def __init__(self) -> None:
        self.changes: list[list[str]] = []
        self.rebuilt = 0

    def change(self, script: str) -> None:
        self.changes.append(list(json.loads(script.removeprefix("show(").removesuffix(")"))))

    def rebuild(self) -> None:
        self.rebuilt += 1

    def answer(self, wrong: int) -> None:
        self.wrong = wrong


def nowhere() -> Transport:
    raise TransportError("no graph in this test")


def test_all_changes_of_a_turn_are_one_script_for_every_browser() -> None:
    site, walls, now = LiveSite(), [Wall(), Wall()], [100.0]
    listener = Listener(site, nowhere)
    cards = Cards(site, listener, lambda: now[0])
    cards.walls += walls

    def turn(*heard: Heard) -> None:
        for one in heard:
            listener.hear(one)
        cards.turn()
        now[0] += 0.1

    first, second = lift(99.0), lift(99.0, "Lift2")
    turn(first, second)
    turn()
    turn(first, second)
    moved = [replace(LIFT, lift_name=name, current_floor="L2") for name in ("Lift1", "Lift2")]
    stamped = [replace(state, lift_time=stamp(WALL + 99.0)) for state in moved]
    turn(*(replace(first, message=message) for message in stamped))
    assert [wall.rebuilt for wall in walls] == [1, 1]
    assert (
        walls[0].changes
        == walls[1].changes
        == [
            ["card/lift/Lift1", "card/lift/Lift2", "status", "standing", "wrong", "robots"],
            ["card/lift/Lift1", "card/lift/Lift2"],
        ]
    )
    assert [wall.wrong for wall in walls] == [0, 0]


def test_a_script_has_every_text_as_data_in_plain_ascii() -> None:
    made = script({place_of(("lift", HOSTILE)): HOSTILE})
    assert made.isascii()
    assert HOSTILE not in made

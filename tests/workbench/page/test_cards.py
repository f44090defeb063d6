"""The scripts that the page sends to a browser. In each turn of its loop, the page sends all
changes in one script. Without a change the page sends no script."""

import json

import pytest
from msgspec.structs import replace

from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from bridges.transports.transport import Transport, TransportError
from tests.workbench.page.test_live_site import LIFT, WALL, heard, lift
from workbench.page import drawing
from workbench.page.cards import STATUS, WRONG, Cards, place_of, script
from workbench.page.drawing import SILENT_DO
from workbench.page.listener import Listener
from workbench.page.live_site import DeviceView, LiveSite

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
            ["card/lift/Lift1", "card/lift/Lift2", "status"],
            ["card/lift/Lift1", "card/lift/Lift2"],
        ]
    )
    assert [wall.wrong for wall in walls] == [0, 0]


def test_after_a_card_could_not_be_drawn_every_browser_gets_everything(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    site, wall, drawn = LiveSite(), Wall(), drawing.card
    listener = Listener(site, nowhere)
    cards = Cards(site, listener, lambda: 99.0)
    cards.walls.append(wall)

    def draw(shown: DeviceView, before: float | None) -> str:
        assert shown.row.name != "Lift2", "Lift2 cannot be drawn"
        return drawn(shown, before)

    listener.hear(lift(99.0))
    monkeypatch.setattr(drawing, "card", draw)
    cards.turn()
    listener.hear(lift(99.0, "Lift2"))
    listener.hear(replace(lift(99.0), message=replace(LIFT, current_floor="L2")))
    with pytest.raises(AssertionError, match="Lift2"):
        cards.turn()  # Lift1 is drawn, and not sent
    monkeypatch.undo()
    rebuilt = wall.rebuilt
    cards.turn()
    cards.turn()
    assert wall.rebuilt == rebuilt + 1


def test_a_panel_and_a_coordinator_that_fell_silent_stay_and_need_attention() -> None:
    site, now = LiveSite(), [1.0]
    listener = Listener(site, nowhere)
    cards = Cards(site, listener, lambda: now[0])
    for kind, name in (("alarm", "Main panel"), ("charger_coordinator", "site")):
        status = {name: {"faults": [], "input_age_s": 0.1, "state": "quiet"}}
        told = diagnosis(f"{kind}_a", kind, {}, status, stamp(WALL))
        listener.hear(heard(1.0, topics.DIAGNOSTICS, told))
    keys = [("alarm", "Main panel"), ("coordinator", "charger_coordinator_a")]
    cards.turn()
    assert (sorted(cards.cards), cards.wrong, cards.parts[WRONG]) == (keys, 0, "")
    now[0] = 9.0
    cards.turn()
    assert (sorted(cards.cards), cards.wrong) == (keys, 2)
    assert ["◷ OLD: silent" in cards.cards[key] for key in keys] == [True, True]
    assert "2 need attention" in cards.parts[STATUS]
    assert cards.parts[WRONG].count("✖ OLD: silent") == cards.parts[WRONG].count(SILENT_DO) == 2


def test_a_script_has_every_text_as_data_in_plain_ascii() -> None:
    made = script({place_of(("lift", HOSTILE)): HOSTILE})
    assert made.isascii()
    assert HOSTILE not in made

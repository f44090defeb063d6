"""The five failures of a simulated wire. Tests compare the levels at the wire's far end, one for each
second."""

from typing import Any

import pytest

from drivers.hal.points import Wire
from hal_fakes.plants.contact import GARBAGE_S, SLOW_S, Contact
from hal_fakes.plants.plant import FailureMode


def wire(active: Any = "high", pull: Any = "down", direction: Any = "in") -> Wire:
    return Wire("signal", direction, "BCM4", active, pull)


def shown(contact: Contact, fed: str, step: float = 1.0) -> str:
    """Return the level at the wire's far end in each second. `fed` has the levels at its near end.

    Both texts have 1 for asserted and 0 for not asserted.
    """
    seen = ""
    for i, value in enumerate(fed):
        contact.feed(value == "1", i * step)
        seen += "01"[contact.shows]
    return seen


@pytest.mark.parametrize(
    ("mode", "text"),
    [
        (None, "0011000111"),
        ("off", "0000000000"),
        ("stuck", "0000000000"),
        ("slow", "0000110001"),
        ("wrong", "1100111000"),
    ],
)
def test_a_wire_that_fails_from_the_start_shows_the_level_of_its_failure(
    mode: FailureMode | None, text: str
) -> None:
    assert SLOW_S == 2.0
    contact = Contact(wire(), "seed")
    contact.fail(mode, 0.0)
    assert shown(contact, "0011000111") == text


@pytest.mark.parametrize(
    ("mode", "held"), [("off", False), ("stuck", True), ("slow", True), ("wrong", False)]
)
def test_an_asserted_wire_shows_its_level_again_after_a_repair(
    mode: FailureMode, held: bool
) -> None:
    contact = Contact(wire(), "seed")
    contact.feed(True, 0.0)
    contact.fail(mode, 1.0)
    failed = contact.shows
    contact.fail(None, 1.5)
    assert (failed, contact.shows) == (held, True)


@pytest.mark.parametrize(
    ("active", "pull", "reads"),
    [("high", "down", False), ("high", "up", True), ("low", "down", True), ("low", "up", False)],
)
def test_a_cut_input_reads_its_pull(active: Any, pull: Any, reads: bool) -> None:
    contact = Contact(wire(active, pull), "seed")
    contact.fail("off", 0.0)
    assert [contact.shows, shown(contact, "0110")] == [reads, "01"[reads] * 4]


@pytest.mark.parametrize(("active", "reads"), [("high", False), ("low", True)])
def test_a_cut_input_of_a_module_reads_0(active: Any, reads: bool) -> None:
    contact = Contact(wire(active, None), "seed")
    contact.fail("off", 0.0)
    assert contact.shows is reads


@pytest.mark.parametrize("active", ["high", "low"])
def test_the_relay_behind_a_cut_output_stays_off(active: Any) -> None:
    contact = Contact(wire(active, None, "out"), "seed")
    contact.fail("off", 0.0)
    assert shown(contact, "0110") == "0000"


def garbage(seed: str) -> list[tuple[float, bool]]:
    contact = Contact(wire(), seed)
    contact.fail("garbage", 5.0)
    seen = []
    while (at := contact.next_at()) < 5.0 + 20.5 * GARBAGE_S:
        contact.feed(False, at)
        seen.append((round(at, 6), contact.shows))
    return seen


def test_garbage_is_random_and_the_same_in_every_run() -> None:
    seen = garbage("a seed")
    assert [at for at, _ in seen] == [round(5.0 + GARBAGE_S * (i + 1), 6) for i in range(20)]
    assert {value for _, value in seen} == {True, False}
    assert seen == garbage("a seed") != garbage("another seed")


def test_a_cut_input_that_nothing_pulls_is_garbage() -> None:
    contact = Contact(wire(pull="none"), "seed")
    contact.fail("off", 0.0)
    seen = {contact.shows}
    for i in range(1, 30):
        contact.feed(False, i * GARBAGE_S)
        seen.add(contact.shows)
    assert seen == {True, False}


def test_only_a_slow_or_random_wire_changes_without_a_new_level() -> None:
    contact = Contact(wire(), "seed")
    modes: tuple[FailureMode | None, ...] = (None, "off", "stuck", "slow", "wrong")
    due = []
    for mode in modes:
        contact.fail(mode, 1.0)
        due.append(contact.next_at())
    assert due == [float("inf")] * 5
    contact.fail("slow", 1.0)
    contact.feed(True, 3.0)
    contact.feed(False, 4.0)
    assert contact.next_at() == 3.0 + SLOW_S

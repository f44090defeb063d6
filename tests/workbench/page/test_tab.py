"""A browser's tab. The tab receives only the changed pieces of the page, and shows times in the
browser's time zone. If no such zone exists, the tab uses this machine's zone."""

from datetime import UTC
from random import Random

import pytest

from workbench.page.tab import PIECE, edits
from workbench.page.zone import zone_of


def test_edits_applied_in_their_order_give_the_new_part() -> None:
    rng = Random(7)
    before: list[str] = []
    for _ in range(200):
        after = [one for one in before if rng.random() > 0.1]
        for _ in range(rng.randrange(4)):
            after.insert(rng.randint(0, len(after)), f"<p>{rng.randrange(5)}</p>")
        told = [*before]
        for first, last, added in edits(before, after):
            told[first:last] = added
        assert told == after
        before = after


def test_a_part_is_its_pieces() -> None:
    html = '<svg><rect x="1"/><text>a</text><path d="M1"/></svg><pre>one\ntwo</pre>'
    assert len(PIECE.split(html)) == 5
    assert "".join(PIECE.split(html)) == html


@pytest.mark.parametrize(
    "name", ["", "../../etc/passwd", "/etc/localtime", "No/Where", "x" * 999, 7]
)
def test_a_zone_that_does_not_exist_is_this_machines(name: object) -> None:
    assert zone_of(name) is None


def test_a_zone_has_its_own_time() -> None:
    assert str(zone_of("Asia/Kolkata")) == "Asia/Kolkata"
    assert zone_of("UTC") in (zone_of("UTC"), UTC)

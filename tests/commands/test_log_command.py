"""`rmf-bridge log`: the command line that it hands to journalctl, and what its pattern finds."""

import argparse
import re

import pytest

from bridges.commands import log
from bridges.log import pairs

LINES = [
    pairs("state", device="Lift1", mode="AGV"),
    pairs("state", device="Lift10", mode="AGV"),
    pairs("fault", device="Lift1", code="OVERLOAD"),
    pairs("fault_over", device="Lift1", code="OVERLOAD"),
    pairs("fault", device='the "east" lift', code="OVERLOAD"),
]


def command(*words: str) -> list[str]:
    parser = argparse.ArgumentParser()
    log.add_arguments(parser)
    return log.command(parser.parse_args(words))


def test_it_asks_the_journal_for_the_unit_of_this_file() -> None:
    assert command("config/lift_a.yaml", "-f", "-n", "5", "--since", "today") == [
        "journalctl",
        "--unit=rmf-bridge@lift_a",
        "--lines=5",
        "--output=short-iso",
        "--no-hostname",
        "--follow",
        "--since=today",
    ]


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("--event", "fault"), [2, 4]),
        (("--device", "Lift1"), [0, 2, 3]),
        (("--device", 'the "east" lift'), [4]),
        (("--event", "state", "--device", "Lift1"), [0]),
        (("--event", "f.*t"), []),
    ],
)
def test_it_finds_only_what_is_about_this_event_or_device(
    words: tuple[str, ...], found: list[int]
) -> None:
    (grep,) = [word for word in command("lift_a.yaml", *words) if word.startswith("--grep=")]
    pattern = re.compile(grep.removeprefix("--grep="))
    assert [i for i, line in enumerate(LINES) if pattern.search(line)] == found

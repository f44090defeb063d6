"""The commands that an explanation proposes. A person can copy each command. Each command names the
graph from which the messages came."""

import re
import shlex
from collections.abc import Iterator
from datetime import UTC

import pytest

from bridges import cli
from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.runtime.faults import for_explain
from tests.workbench.explain.situations import SCENES
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.phrases import JOINS, on_graph

GRAPH = ("--config", "our site.yaml", "--domain-id", "7", "--transport", "zenoh", "--localhost")
WHOLE = cli.whole_parser()


def joins(command: str) -> bool:
    """Return whether this subcommand joins a graph, and has options that name the graph."""
    (subparsers,) = (one for one in WHOLE._actions if one.dest == "command")
    assert isinstance(subparsers.choices, dict)
    return "--localhost" in subparsers.choices[command].format_help() or command == "send"


def proposed(texts: list[str]) -> Iterator[list[str]]:
    """Yield the words of each command between backticks."""
    for text in texts:
        for command in re.findall(r"`rmf-bridge ([^`]*)`", text):
            yield shlex.split(command)


def texts_of(one: Explanation) -> list[str]:
    return [*one.now, *one.notes, *(s.what for s in one.next), *(f.do for f in one.faults)]


def assert_all_name_it(texts: list[str]) -> None:
    for words in proposed(texts):
        if words[0] == "doctor":
            assert words[1:] == ["FILE", *GRAPH[2:]]
        elif joins(words[0]):
            assert words[-len(GRAPH) :] == [*GRAPH]
            found = WHOLE.parse_args(words)
            assert (str(found.config), found.domain_id, found.localhost) == (GRAPH[1], 7, True)
        else:
            assert not set(words) & set(GRAPH)


def test_every_command_that_joins_a_graph_is_known() -> None:
    known = JOINS.pattern.split("(")[2].partition(")")[0].split("|")
    assert known == sorted(command for command in cli.COMMANDS if joins(command))


@pytest.mark.parametrize("name", SCENES)
def test_a_situations_commands_name_the_graph(name: str) -> None:
    heard, kind, device = SCENES[name]()
    site = HeardDevices(device, graph=GRAPH)
    for one in heard:
        site.take(one)
    assert_all_name_it(texts_of(site.explain(kind, device, UTC, for_explain())))


def test_each_faults_remedy_names_the_graph() -> None:
    assert_all_name_it([on_graph(do, GRAPH) for _, do in for_explain().values()])
    assert not [do for _, do in for_explain().values() if re.search(r"`(send|release) ", do)]


def test_nothing_heard_is_looked_into_on_that_graph() -> None:
    site = HeardDevices("Lift1", graph=GRAPH)
    site.pass_time(100.0, 1_800_000_000.0)
    texts = texts_of(site.explain("lift", "Lift1", UTC, {}))
    assert [*proposed(texts)] == [["doctor", "FILE", *GRAPH[2:]]]


def test_a_name_of_several_words_is_one_word_of_the_command() -> None:
    site = HeardDevices("Lift; reboot", graph=GRAPH)
    asks = d.LiftRequest("Lift; reboot", stamp(1e9), "b/c", 1, "L1", 2)
    site.take(Heard(0.0, 1e9, "adapter_lift_requests", asks))  # so requests are recorded
    for n in range(9):
        state = d.LiftState(
            stamp(1e9 + n), "Lift; reboot", ("L1",), "L1", current_mode=2, session_id="a/b"
        )
        site.take(Heard(float(n), 1e9 + n, "lift_states", state))
    texts = texts_of(site.explain("lift", "Lift; reboot", UTC, {}))
    assert [*proposed(texts)] == [["release", "Lift; reboot", *GRAPH]]

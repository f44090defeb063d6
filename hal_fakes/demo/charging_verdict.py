"""Whether the charging demo went right, from the journal alone: pure."""

from collections.abc import Iterable
from itertools import groupby

from bridges.rmf import definitions as d
from bridges.rmf import words
from hal_fakes.demo.journal import Journal

CHARGED = {
    "charger_a": ["AMR02", "AMR01"],
    "charger_b": ["AMR01", "AMR03", "AMR01"],
}
"""Who was charged where, in order; nobody else, nowhere else."""


def problems(journal: Journal) -> list[str]:
    """Everything that was not as it should be; empty when the day went right."""
    return [*_charged(journal), *_shared(journal), *_unverified(journal)]


def _states(journal: Journal) -> list[d.ChargerState]:
    return [state for state in journal.states if isinstance(state, d.ChargerState)]


def _charged(journal: Journal) -> Iterable[str]:
    for charger, expected in CHARGED.items():
        mine = [s for s in _states(journal) if s.charger_name == charger]
        seen = [(_word(s), s.robot_name) for s in mine]
        robots = [who for (state, who), _ in groupby(seen) if state == "CHARGING"]
        if robots != expected:
            yield f"{charger} charged {' '.join(robots) or 'nobody'}, expected {' '.join(expected)}"


def _shared(journal: Journal) -> Iterable[str]:
    """Never one robot on two chargers, as far as their states say."""
    latest: dict[str, d.ChargerState] = {}
    for state in _states(journal):
        latest[state.charger_name] = state
        charging = [s.robot_name for s in latest.values() if _word(s) == "CHARGING"]
        if len(set(charging)) != len(charging):
            yield f"{state.robot_name} was charged at two chargers at once"
            return


def _unverified(journal: Journal) -> Iterable[str]:
    """What is charged was asked for, by the coordinator."""
    for state in _states(journal):
        if _word(state) == "CHARGING" and not state.request_id.startswith("charger_coordinator/"):
            yield f"{state.charger_name} charged for {state.request_id or 'no request'}"
            return


def _word(state: d.ChargerState) -> str:
    return words.word(d.ChargerStateValue, state.state)


def summary(journal: Journal) -> str:
    """What was done, in a few lines."""
    legs = "\n".join(f"       {name}: {s:.1f} s" for name, s in journal.legs.items())
    return (
        "\nRIGHT: five situations, each dealt with; never two robots at one charger.\n"
        f"{legs}\n       {len(journal.requests)} requests, {len(journal.states)} states\n"
    )

"""Recordings of earlier versions. Every later version can read them, because each recordable type has a
fixed name."""

import gzip
import subprocess
import sys
import typing
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.blackbox.entries import AnyEntry, Decided, Head, Known
from bridges.blackbox.value_codec import TYPE, UnknownValue, name_of, tree, value
from bridges.kinds import kind_called, kind_names, recorded
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.recorded import SHARED
from bridges.runtime.record import ClaimRecord
from drivers.profiles import texts
from tests.blackbox.earlier import DAYS
from tests.blackbox.recordable import recordable, specimens
from workbench.replay.files import opened
from workbench.replay.replayed import Replay, ReplayedCores, of_head
from workbench.replay.sources import Notes

ENDED = {
    "charger_coordinator.memory.Memory.rested",
    "lift.memory.Memory.alarmed",
    "lift.memory.Session.own_stamp",
    "lift.signals.FromAdapter.stamp",
}
"""Fields that earlier cores had, and that no present core has. A reader drops their values."""


def files(pattern: str) -> list[Path]:
    """Return the files of all days that match the pattern."""
    return [path for day in DAYS for path in sorted(day.glob(pattern))]


@pytest.fixture(autouse=True)
def _own_texts() -> Iterator[None]:
    yield
    texts.give({})


def test_every_type_that_a_daemon_can_record_has_a_name_and_comes_back() -> None:
    """If this test fails, add the missing name to `RECORDED` of the kind, or of
    `bridges/kinds/shared/recorded.py`."""
    nameless = []
    for one in recordable():
        kind = typing.get_origin(one) or one
        try:
            name_of(kind)
        except TypeError:
            nameless.append(f"{kind.__module__}.{kind.__qualname__}")
            continue
        for specimen in specimens(one):
            assert value(tree(specimen)) == specimen
            if hasattr(specimen, "news"):
                assert value(tree(specimen.news())) == specimen.news()
    assert nameless == []


def test_a_name_is_given_once_to_a_type_that_a_daemon_records_and_begins_with_its_kind() -> None:
    every = [*SHARED.items()]
    for kind in kind_names():
        own = recorded(kind)
        assert [name for name in own if not name.startswith(f"{kind}.")] == []
        every += own.items()
    assert len({name for name, _ in every}) == len(every)
    assert {one for _, one in every} == {typing.get_origin(one) or one for one in recordable()}


@pytest.mark.parametrize("day", DAYS, ids=lambda day: day.name)
def test_no_name_and_no_field_of_an_earlier_version_is_lost(day: Path) -> None:
    """A renamed type keeps its old name in the table `RECORDED`. A renamed field keeps its old name
    through `msgspec.field(name=…)`."""
    told = msgspec.json.decode((day / "values.json").read_bytes())
    lost = set()
    for earlier in chain.from_iterable(told.values()):
        lost |= _lost(earlier, tree(value(earlier)))
    assert lost - ENDED == set()


def _lost(was: Any, now: Any) -> set[str]:
    """Return the fields that this version no longer reads."""
    if isinstance(was, list) and isinstance(now, list):
        return {lost for one, other in zip(was, now, strict=True) for lost in _lost(one, other)}
    if not isinstance(was, dict) or not isinstance(now, dict):
        return set()
    assert was[TYPE] == now[TYPE]
    kept = {name for name in was if name in now}
    gone = {f"{was[TYPE]}.{name}" for name in was if name not in kept}
    return gone.union(*(_lost(was[name], now[name]) for name in kept))


@pytest.mark.parametrize(
    "file", files("*.mcap"), ids=lambda file: f"{file.parent.name} {file.name}"
)
def test_a_recording_of_an_earlier_version_is_read_and_replayed(file: Path) -> None:
    _is_read(file)


@pytest.mark.parametrize(
    "file", files("*.ring.gz"), ids=lambda file: f"{file.parent.name} {file.name}"
)
def test_a_ring_of_an_earlier_version_is_read_and_replayed(file: Path, tmp_path: Path) -> None:
    ring = tmp_path / "ring"
    ring.write_bytes(gzip.decompress(file.read_bytes()))
    _is_read(ring)


def _is_read(file: Path) -> None:
    """Check that this version can read and replay the file. Decisions may differ, because later cores
    may decide differently."""
    notes = Notes()
    head, entries = opened(file, notes)
    everything = list(entries)
    for entry in everything:
        for told in _values(entry):
            value(told)
    replay = Replay(everything, ReplayedCores(of_head(head)))
    list(replay.differences())
    assert (notes.damage, replay.course.unusable, len(replay.course.subjects) > 0) == ("", 0, True)
    assert replay.course.decisions > 10


def _values(entry: AnyEntry) -> Iterator[Any]:
    if isinstance(entry, Known):
        yield from (entry.memory, entry.reading, entry.outputs, entry.report)
    elif isinstance(entry, Decided):
        yield entry.event
        yield from chain(entry.outputs, entry.news, entry.faults)
        yield from (message for _topic, message in typing.cast(Any, entry.publish))


@pytest.mark.parametrize(
    "file", files("*.kept"), ids=lambda file: f"{file.parent.name} {file.name}"
)
def test_what_a_kind_without_hardware_kept_is_restored_whole(file: Path) -> None:
    head: Head = opened(file.with_suffix(".mcap"), Notes())[0]
    kind = kind_called(head.kind)
    assert isinstance(kind, GraphKind)
    assert kind.restore
    assert kind.persist

    restored = kind.restore(file.read_bytes(), of_head(head).section, 100.0)

    assert msgspec.json.decode(kind.persist(restored)) == msgspec.json.decode(file.read_bytes())


@pytest.mark.parametrize(
    "file", files("claimed-*.json"), ids=lambda file: f"{file.parent.name} {file.name}"
)
def test_a_record_of_an_earlier_version_says_what_is_to_be_switched_off(file: Path) -> None:
    record = msgspec.json.decode(file.read_bytes(), type=ClaimRecord)
    config = record.config()
    assert record.name == file.name
    assert record.claim
    assert (set(config.devices), set(config.buses)) == (
        set(record.claim.devices),
        set(record.claim.buses),
    )


def test_names_load_no_other_kind_than_the_one_that_is_recorded() -> None:
    script = (
        "import sys; from bridges.kinds.lift import memory;"
        "from bridges.blackbox.value_codec import tree, value;"
        "assert value(tree(memory.LiftMemory())) == memory.LiftMemory();"
        "print([name for name in ('door', 'charger', 'lift_supervisor', 'door_supervisor',"
        " 'charger_coordinator') if sys.modules.keys() & {memory.__name__.replace('lift', name)}])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"


@pytest.mark.parametrize(
    "name", ["lift.memory.Nobody", "lift.core.decide", "os.system", "lift", ""]
)
def test_what_has_no_name_is_unknown(name: str) -> None:
    with pytest.raises(UnknownValue):
        value({TYPE: name, "=": ["true"]})

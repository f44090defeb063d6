"""Wrong recordings and rings that the decoder still reads.

Each mutant is a valid recording of `corpus` with some changed values. Types, times, releases, versions
or the nesting may be wrong.
"""

import io
import os
import random
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
from mcap.writer import CompressionType, Writer
from msgspec.structs import replace

from bridges import cli
from bridges.blackbox import entries
from bridges.blackbox.entries import Spoken
from bridges.blackbox.mcap_write import ENTRIES, HEAD, NOTES, String
from bridges.blackbox.recorder import Recorder
from bridges.blackbox.recordings import Recordings
from bridges.blackbox.ring import FRAME, MAGIC, MARK, PAGE, SEGMENTS, TOP
from bridges.messages import cdr
from bridges.messages.definitions import Message
from bridges.messages.releases import RELEASES
from bridges.messages.rihs01 import MESSAGES, type_name
from bridges.messages.texts import text
from workbench.page.incidents import read
from workbench.page.levels import Levels
from workbench.replay.bags import heard_in
from workbench.replay.files import opened
from workbench.replay.sources import BagError, Notes

CORPUS: Final = Path(__file__).parents[1] / "workbench/replay/corpus"
NUMBERS: Final = (
    *(0, -1, 1, 3, 2**31, 2**53, 2**63 - 1, -(2**63), 2**64 - 1),
    *(0.5, -0.0, 1e-300, 1e10, 9e18, 1e300, -1e300, float("nan"), float("inf"), float("-inf")),
)
TEXTS: Final = ("", "x", "jazzy", "rolling", "0", "nan", "-inf", "\0", "é\u202e", "L" * 3000, "a/b")
TREES: Final[tuple[Any, ...]] = (
    None,
    True,
    [],
    {},
    [[]],
    [[None]],
    {"": ""},
    {"": "number", "=": "x"},
    {"": "number", "=": "nan"},
    {"": "map", "=": [[[], 1]]},
    {"": "map", "=": [[{"": "map", "=": []}, 1]]},
    {"": "map", "=": [1]},
    {"": "set", "=": [[], {}]},
    {"": "set", "=": [{"": "map", "=": []}]},
    {"": "core.decision.Sampled"},
    {"": "core.decision.Sampled", "sample": None},
    {"": "core.decision.IoFailed", "reason": 7},
    {"": "core.decision.OperatorReset"},
    {"": "core.decision.Fault", "code": None},
    {"": "rmf.definitions.LiftState"},
    {"": "lift.signals.Future", "a": 1},
    {"": "lift.core.decide"},
    {"": 7},
    [{"": "core.decision.Fault", "code": "X", "detail": 3}],
)
KEPT: Final = 70
"""The number of entries, and the number of messages, that a recording keeps. It is so small that the
mutants together change most entries."""


@dataclass(frozen=True)
class Plain:
    """A recording as decoded JSON: its head and its entries."""

    kind: str
    subject: str
    head: dict[str, Any]
    entries: list[list[Any]]


def corpus() -> list[Plain]:
    """Return recordings of the soak test's incidents. The entries include the messages."""
    return [_plain(path) for path in sorted(CORPUS.glob("*.mcap"))]


def _plain(path: Path) -> Plain:
    head, found = opened(path, Notes())
    every = list(found)[:KEPT]
    clock = next(one for one in every if isinstance(one, entries.Clocks))
    off = clock.wall - clock.at
    spoken = [_spoken(one.at - off, one.topic, one.message) for one in heard_in(path)]
    together = sorted([*every, *spoken[:KEPT]], key=lambda one: one.at)
    told = [msgspec.msgpack.decode(entries.encode(one)) for one in together]
    known = next(one for one in every if isinstance(one, entries.Known))
    return Plain(head.kind, known.subject, msgspec.to_builtins(head, builtin_types=(bytes,)), told)


def _spoken(at: float, topic: str, message: Message) -> Spoken:
    kind, release = type(message), RELEASES["kilted"]
    return Spoken(at, True, topic, type_name(kind), "kilted", cdr.encode(kind, message, release))


class Mutator:
    """A maker of wrong recordings from valid recordings. The same seed gives the same recordings."""

    def __init__(self, seed: int) -> None:
        self._rng = random.Random(seed)
        self._corpus = corpus()

    def next(self) -> Plain:
        """Return the next wrong recording, with one to three changes."""
        valid = self._rng.choice(self._corpus)
        copied: Plain = Plain(
            valid.kind, valid.subject, _copy(valid.head), [_copy(one) for one in valid.entries]
        )
        for _ in range(self._rng.randint(1, 3)):
            self._change(copied)
        return copied

    def _change(self, told: Plain) -> None:
        match self._rng.randrange(10):
            case 0:
                self._one(told.head)
            case 1:
                at = self._rng.randrange(len(told.entries))
                told.entries[at][1] = self._rng.choice(NUMBERS)
            case 2:
                self._version(told)
            case 3:
                self._message(told)
            case 4:
                self._rng.shuffle(told.entries)
            case _:
                self._one(self._rng.choice(told.entries))

    def _one(self, tree: Any) -> None:
        """Change one value anywhere in the tree."""
        places = list(_places(tree))
        holder, key = self._rng.choice(places)
        match self._rng.randrange(8):
            case 0 if isinstance(holder, dict):
                del holder[key]
            case 1 if isinstance(holder, dict):
                holder["another"] = holder.pop(key)
            case 2:
                other, place = self._rng.choice(places)
                holder[key] = _copy(other[place])
            case 3:
                holder[key] = [holder[key]]
            case 4:
                deep: Any = holder[key]
                for _ in range(self._rng.choice((5, 300))):
                    deep = [deep]
                holder[key] = deep
            case _:
                holder[key] = self._odd(holder[key])

    def _odd(self, was: Any) -> Any:
        if isinstance(was, bytes):
            return self._rng.choice((b"", was[:-1], was + b"\0", bytes(8), b"\xff" * 16, "text"))
        same = NUMBERS if isinstance(was, int | float) else TEXTS if isinstance(was, str) else TREES
        if self._rng.random() < 0.6:
            return self._rng.choice(same)
        return _copy(self._rng.choice((*NUMBERS, *TEXTS, *TREES)))

    def _version(self, told: Plain) -> None:
        """Replace the name of a type, field or topic, as another version might."""
        entry = self._rng.choice(told.entries)
        if is_message(entry):
            entry[self._rng.choice((3, 4, 5))] = self._rng.choice((*TEXTS, *MESSAGES, *RELEASES))
            return
        typed = [tree for tree in _trees(entry) if "" in tree]
        if typed:
            tree = self._rng.choice(typed)
            others = [one for e in told.entries for one in _trees(e) if "" in one]
            tree[""] = self._rng.choice(others)[""]

    def _message(self, told: Plain) -> None:
        """Change the value of one field of a message."""
        spoken = [one for one in told.entries if is_message(one) and one[5] in (*RELEASES,)]
        if not spoken:
            return
        entry = self._rng.choice(spoken)
        try:
            release = RELEASES[entry[5]]
            message = cdr.decode(MESSAGES[entry[4]], entry[6], release)
            entry[6] = cdr.encode(type(message), self._other(message), release)
        except cdr.CdrError:
            return

    def _other(self, message: Any) -> Any:
        name = self._rng.choice(message.__struct_fields__)
        was = getattr(message, name)
        if isinstance(was, msgspec.Struct):
            return replace(message, **{name: self._other(was)})
        if isinstance(was, tuple):
            many = was * self._rng.choice((0, 2, 300))
            return replace(message, **{name: many})
        same = NUMBERS if isinstance(was, int | float) else TEXTS
        return replace(message, **{name: self._rng.choice(same)})


SPOKEN: Final = 1


def _copy(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {key: _copy(part) for key, part in tree.items()}
    return [_copy(part) for part in tree] if isinstance(tree, list) else tree


def _trees(tree: Any) -> Iterator[dict[str, Any]]:
    for holder, key in _places(tree):
        if isinstance(holder[key], dict):
            yield holder[key]


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every place in the tree as (container, key)."""
    keys = list(tree) if isinstance(tree, dict) else range(len(tree))
    for key in keys:
        yield tree, key
        if isinstance(tree[key], dict | list):
            yield from _places(tree[key])


def as_ring(told: Plain) -> bytes:
    """Return a ring whose only segment has the recording's entries."""
    head = msgspec.msgpack.encode(told.head)
    content = b"".join(_frame(msgspec.msgpack.encode(one), 1) for one in told.entries)
    size = -(-(MARK.size + len(content) + FRAME.size) // PAGE) * PAGE
    top = TOP.pack(MAGIC, 0, size, len(head)) + struct.pack("<I", zlib.crc32(head)) + head
    segment = MARK.pack(1, zlib.crc32((1).to_bytes(8, "little"))) + content
    first = -(-len(top) // PAGE) * PAGE
    return top.ljust(first, b"\0") + segment.ljust(size, b"\0") + bytes((SEGMENTS - 1) * size)


def _frame(content: bytes, number: int) -> bytes:
    return FRAME.pack(len(content), zlib.crc32(content, number)) + content


def write_file(told: Plain, path: Path) -> None:
    """Write the recording in the format of the recorder's files."""
    with path.open("wb") as out:
        writer = Writer(out, compression=CompressionType.ZSTD)
        writer.start("ros2", "rmf-bridges 1")
        writer.add_metadata(HEAD, {"head": msgspec.json.encode(told.head).decode()})
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        own = {
            topic: writer.register_channel(f"/{topic}", "cdr", schema) for topic in (ENTRIES, NOTES)
        }
        for one in told.entries:
            at = one[1] if isinstance(one[1], int | float) and abs(one[1]) < 1e9 else 0
            at_ns = round(max(at, 0) * 1e9)
            if is_message(one):
                _message(writer, own, one, at_ns)
                continue
            told_one = msgspec.json.encode(one).decode()
            sample = cdr.encode(String, String(told_one))
            writer.add_message(own[ENTRIES], at_ns, sample, at_ns)
        writer.finish()  # type: ignore[no-untyped-call]


def is_message(entry: list[Any]) -> bool:
    """Return whether the entry is a message of a known type."""
    match entry:
        case [1, _, _, str(), str() as kind, _, bytes(), *_]:
            return kind in MESSAGES
    return False


def _message(writer: Writer, own: dict[str, int], one: list[Any], at_ns: int) -> None:
    kind, topic = one[4], str(one[3])
    if f"{topic} {kind}" not in own:
        definition = text(MESSAGES[kind], RELEASES["kilted"]).encode()
        schema = writer.register_schema(kind, "ros2msg", definition)
        own[f"{topic} {kind}"] = writer.register_channel(f"/{topic}", "cdr", schema)
    writer.add_message(own[f"{topic} {kind}"], at_ns, one[6], at_ns)


Codes = frozenset[int]
READS: Final[Codes] = frozenset({0, 1, os.EX_NOINPUT})
DECIDES: Final[Codes] = READS | {os.EX_DATAERR, os.EX_CONFIG}
WRITES: Final[Codes] = frozenset({0, os.EX_DATAERR, os.EX_UNAVAILABLE})
JUDGES: Final[Codes] = READS | {os.EX_UNAVAILABLE}


def commands(told: Plain, folder: Path) -> Iterator[tuple[tuple[str, ...], Codes]]:
    """Yield each command that reads recordings or rings, with the exit codes that it may give.

    The function writes all files into `folder`.
    """
    run = folder / "run"
    run.mkdir(parents=True, exist_ok=True)
    for name in ("ring", "ring.died"):
        (run / name).write_bytes(as_ring(told))
    file, yaml, out = folder / "a.mcap", folder / "a.yaml", str(folder / "out.mcap")
    write_file(told, file)
    yaml.write_bytes(told.head["yaml"] if isinstance(told.head.get("yaml"), bytes) else b"")
    for path in map(str, (run / "ring", file)):
        yield ("replay", path), DECIDES
        yield ("replay", path, "--config", str(yaml), "--json"), DECIDES
        yield ("explain", path, told.subject), READS
        if told.kind in ("lift", "door", "charger"):
            yield ("plot", path, "--device", told.subject, "-o", str(folder / "a.html")), READS
            yield ("judge", told.kind, told.subject, "--recording", path), JUDGES
    of = ("incident", str(yaml), "--runtime-dir", str(run), "-o", out)
    yield (*of, "--after", "0"), WRITES
    yield (*of, "--died", "--anonymous"), WRITES


def ended(words: Sequence[str]) -> tuple[int, str]:
    """Return a command's exit code and its text on standard error."""
    errors = io.StringIO()
    with redirect_stdout(io.StringIO()), redirect_stderr(errors):
        code = cli.main([*words])
    return code, errors.getvalue()


def endings(mutator: Mutator, times: int, folder: Path) -> Counter[str]:
    """Run the commands on `times` wrong recordings, and count the exit codes. Raise an error if a
    command gives any other exit code."""
    found: Counter[str] = Counter()
    for _ in range(times):
        told = mutator.next()
        for words, codes in commands(told, folder):
            code, said = ended(words)
            assert code in codes, (words, code, said)
            assert code < os.EX_USAGE or said.strip(), (words, code)
            assert "Traceback" not in said, said
            found[f"{words[0]}: {code}"] += 1
        with suppress(BagError):
            read(folder / "a.mcap", {})
        recorder = Recorder(
            lambda: [folder / "run"], Recordings(folder / "recordings"), lambda: 0.0
        )
        recorder.look()
        recorder.close()
        Levels(folder / "run").look()
    return found

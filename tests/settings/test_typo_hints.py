"""`check` describes typing mistakes in plain words. Each message names the key that it is about. No
message shows words of the YAML parser or a regular expression."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec.inspect import (
    DictType,
    ListType,
    Metadata,
    StrType,
    StructType,
    Type,
    UnionType,
    VarTupleType,
    type_info,
)

from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.yaml.typo_hints import number_meant
from tests.settings.reading import changed, problems_of

NEWLINE = "\n"
NBSP = "\u00a0"
LIMIT = "limits: {open_s: 3, tries: 2}"

SLIPS = {
    "a line that is too far to the right": (
        changed("      closed:", "       closed:"),
        [
            "11:8: wrong indent: 7 spaces before this line, 6 (line 10) before the lines above: keys of"
            " one section have the same indent"
        ],
    ),
    "a line that is too far to the left": (
        changed("    inputs:", "   inputs:"),
        [
            "9:4: wrong indent: 3 spaces before this line, 2 (line 7) or 4 (line 8) before the lines"
            " above: keys of one section have the same indent"
        ],
    ),
    **{
        f"a line that is too far to the left, and right lines below: {line.strip()}": (
            changed("    codes: {1: in, 2: out}", line),
            [
                f"{15 + line.count(NEWLINE)}:{column}: line 14 has its value already, so nothing can"
                " stand below it: indent line 14 by 4 spaces like line 12, or this line by 2 like"
                " line 14"
            ],
        )
        for line, column in (
            ("  bus: header", 11),
            ("  bus: &one header", 11),
            ("  bus: header\n", 11),
            ("  bus: header  # this one", 5),
            ("  bus: header\n    # why", 5),
            ('  bus: "header"', 5),
            ("  bus: 'the # header'", 5),
            ("  codes: {1: in, 2: out}", 5),
            ("  lanes: [in, out]  # both", 5),
        )
    },
    "a line that is too far to the right, below a line with a value": (
        changed("    limits:", "      limits:"),
        [
            "15:7: line 14 has its value already, so nothing can stand below it: indent line 14 by 6"
            " spaces like line 13, or this line by 4 like line 14"
        ],
    ),
    "a line with an indent that no earlier line of its section has": (
        changed("    limits:", "        limits:").replace("codes: {1: in, 2: out}", "bus: header"),
        [
            "15:15: a second ': ' here: indent the line like its neighbours, or put the text in quotes"
        ],
    ),
    "a key without a space after its colon": (
        changed("{transport: dds, domain_id: 7}", "\n  transport:dds\n  domain_id: 7"),
        ["5:12: the line above has no ': ': write a colon and a space after its key"],
    ),
    "a bracket that is never closed": (
        changed("lanes: [in, out]", "lanes: [in, out"),
        ["9:11: a ',' is missing here, or the '[' of line 8 is not closed"],
    ),
    "a bracket too many": (
        changed(LIMIT, f"{LIMIT}}}"),
        ["15:34: a '}' without a '{' before it"],
    ),
    "a section that stands beside what it belongs to": (
        changed("  north:\n", "north:\n").replace("\n    ", "\n  "),
        [
            "6:1: 'gates' has no value: write a mapping (key: value)",
            "7:1: 'north' stands beside 'gates', which is empty: indent 'north'",
        ],
    ),
    "a device's section at the top": (
        changed("    limits:", "limits:"),
        ["15:1: 'limits' does not belong here: write it below 'gates: <name>'"],
    ),
    "a limit beside the limits": (
        changed("    limits:", "    open_s: 3\n    limits:"),
        ["15:5: 'open_s' does not belong here: write it below 'limits'"],
    ),
    "a setting of RMF's at the top": (
        changed("driver: contact", "driver: contact\ndomain_id: 3"),
        ["3:1: 'domain_id' does not belong here: write it below 'rmf'"],
    ),
    "a decimal comma": (
        changed(LIMIT, "limits:\n      open_s: 3,5"),
        ["16:15: 'open_s' is written 3,5: write 3.5, a number from 0.1 to 60 s"],
    ),
    "a decimal comma within braces": (
        changed("open_s: 3,", "open_s: 3,5,"),
        ["15:24: a comma inside a number: write 3.5"],
    ),
    "a comma that may be either": (
        changed(LIMIT, "limits:\n      open_s: 3,500"),
        ["16:15: 'open_s' is written 3,500: write 3.500, or 3500, a number from 0.1 to 60 s"],
    ),
    "a whole number with its thousands apart": (
        changed("tries: 2", "tries: 1'000"),
        ["15:32: 'tries' is written 1'000: write 1000, a whole number of at least 1"],
    ),
    "a number in wide digits": (
        changed("tries: 2", "tries: \uff12"),
        ["15:32: 'tries' is written \uff12: write 2, a whole number of at least 1"],
    ),
    "a unit of its own": (
        changed("open_s: 3", "open_s: 300 ms"),
        ["15:22: 'open_s' is written 300 ms: write the number alone, a number from 0.1 to 60 s"],
    ),
    "a no-break space within a number": (
        changed("tries: 2", f"tries: 1{NBSP}000"),
        [
            "15:32: a no-break space (U+00A0): write an ordinary space, or put the text in quotes to"
            " keep it"
        ],
    ),
    "a no-break space in a key": (
        changed("driver:", f"driver{NBSP}:"),
        [
            "2:1: a no-break space (U+00A0): write an ordinary space, or put the text in quotes to"
            " keep it"
        ],
    ),
    "a no-break space after a colon": (
        changed("kind: gate", f"kind:{NBSP}gate"),
        [
            "1:1: a no-break space (U+00A0): write an ordinary space, or put the text in quotes to"
            " keep it",
            "2:7: the line above has no ': ': write a colon and a space after its key",
        ],
    ),
    "a no-break space as an indent": (
        changed("    limits:", f"   {NBSP}limits:"),
        ["15:4: a no-break space (U+00A0) on line 15, column 4: write an ordinary space"],
    ),
    "curly quotes": (
        changed("lanes: [in, out]", "lanes: [\u201cin\u201d, out]"),
        ["8:13: YAML does not read \u201c as a quote: write \" or '"],
    ),
}


@pytest.mark.parametrize("what", SLIPS)
def test_a_typing_mistake_is_named(file: Path, what: str) -> None:
    text, told = SLIPS[what]
    assert problems_of(file, text) == told


def test_a_no_break_space_in_quotes_is_accepted(file: Path) -> None:
    assert problems_of(file, changed("  north:", f'  "north{NBSP}1":')) == []


def test_a_text_does_not_count_as_a_number() -> None:
    texts = ("", "-", "fast", "1:30", "017", "1_000", "1.2.3", "1,2,3", "3.5", "12")
    assert [number_meant(text, whole) for text in texts for whole in (False, True)] == [""] * 20


def test_a_problem_between_two_keys_names_its_subject(file: Path) -> None:
    text = """\
kind: door
driver: dry_contact
buses:
  module: {type: modbus}
doors:
  ward:
    pulse: {on_s: 3, every_s: 2}
    inputs: {opened: {point: unit 1 discrete input 0, active: high}}
    outputs: {hold_open: {point: unit 1 coil 0, active: high}}
"""
    assert problems_of(file, text) == [
        "4:3: 'module' needs a connection: write tcp: {host: …} or serial: {port: …}",
        "7:19: 'on_s' must be shorter than every_s; delete pulse if the relay must stay on",
        "8:5: 'inputs' needs 'closed'; if the door has no such contact, write feedback: estimated",
    ]


def patterns(wanted: Type, words: str = "") -> Iterator[tuple[str, str]]:
    """Yield every pattern in a type, together with the words that describe this pattern."""
    match wanted:
        case Metadata(type=inner, extra=extra):
            yield from patterns(inner, (extra or {}).get("pattern", words))
        case StrType(pattern=pattern) if pattern:
            yield pattern, words
        case StructType(fields=fields):
            for field in fields:
                yield from patterns(field.type)
        case UnionType(types=types):
            for member in types:
                yield from patterns(member)
        case ListType(item_type=inner) | VarTupleType(item_type=inner):
            yield from patterns(inner)
        case DictType(key_type=key, value_type=inner):
            yield from patterns(key)
            yield from patterns(inner)


def test_every_pattern_is_described_in_words() -> None:
    structs = [Rmf, *(named.bus_called(name).settings for name in named.bus_types())]
    for name in kind_names():
        kind = kind_called(name)
        structs += [kind.settings] if isinstance(kind, GraphKind) else []
        structs += [named.driver_called(name, d).settings for d in named.driver_names(name)]
    found = {pattern: words for struct in structs for pattern, words in patterns(type_info(struct))}
    assert len(found) >= 6
    assert [pattern for pattern, words in found.items() if not words] == []

"""For a file that is not a device YAML, the loader reports one clear problem with its place."""

import os
import socket
from pathlib import Path

import pytest

from bridges.settings.load import SettingsError, load
from tests.settings.reading import RIGHT, changed, config_of, problems_of


def why_not(path: Path) -> list[str]:
    with pytest.raises(SettingsError) as error:
        load(path)
    return [str(p).removeprefix(f"{path}:") for p in error.value.problems]


def test_a_missing_file_is_one_problem(tmp_path: Path) -> None:
    assert why_not(tmp_path / "no.yaml") == ["1:1: cannot be read: No such file or directory"]


def test_a_folder_is_one_problem(tmp_path: Path) -> None:
    assert why_not(tmp_path) == ["1:1: cannot be read: Is a directory"]


def test_a_pipe_and_a_device_and_a_socket_are_one_problem_without_a_wait(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    wrong = "1:1: cannot be read: it is a pipe, a socket or a device, not a file"
    assert why_not(tmp_path / "pipe") == [wrong]
    assert why_not(Path("/dev/zero")) == [wrong]
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "socket"))
        assert why_not(tmp_path / "socket") == ["1:1: cannot be read: No such device or address"]


def test_a_name_that_no_file_can_have_is_one_problem() -> None:
    said = why_not(Path("a\0b"))[0]
    assert said.startswith("1:1: cannot be read: ")
    assert "embedded null" in said  # the rest of the text depends on Python's version


def test_a_file_longer_than_any_device_yaml_is_not_read(file: Path) -> None:
    assert problems_of(file, "#" * 300_000) == [
        "1:1: longer than 256 KiB: this is not a device YAML"
    ]


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "\n\n", "\ufeff"])
def test_an_empty_file_is_one_problem(file: Path, text: str) -> None:
    assert problems_of(file, text) == ["1:1: the file is empty: begin it with 'kind: ...'"]


@pytest.mark.parametrize("text", ["- a\n- b\n", "gate\n", "---\n", "[]"])
def test_a_file_that_is_not_a_mapping_is_one_problem(file: Path, text: str) -> None:
    assert problems_of(file, text) == ["1:1: the file is not a mapping: begin it with 'kind: ...'"]


def test_bytes_that_are_not_utf_8_are_named_at_their_place(file: Path) -> None:
    text = "kind: gate\r\nname: Lïft\n".encode("latin-1")
    assert problems_of(file, text) == ["2:8: byte 0xef is not UTF-8: save the file as UTF-8"]


def test_a_byte_order_mark_does_no_harm(file: Path) -> None:
    assert problems_of(file, "\ufeff" + RIGHT) == []
    (problem,) = problems_of(file, "\ufeff" + changed("kind: gate", "kind: gait"))
    assert problem.startswith("1:7: ")


def test_lines_may_end_as_on_windows(file: Path) -> None:
    assert config_of(file, RIGHT.replace("\n", "\r\n")).devices == config_of(file, RIGHT).devices


def test_a_control_character_is_named_at_its_place(file: Path) -> None:
    assert problems_of(file, "kind: gate\n# \x07\n") == [
        "2:3: the character U+0007 is not allowed in YAML: delete it"
    ]


SYNTAX = {
    "kind:\n\tgate\n": "2:1: a tab: YAML indents with spaces",
    "kind: gate\n  driver: contact\n": (
        "2:9: a second ': ' here: indent the line like its neighbours, or put the text in quotes"
    ),
    "kind: gate\ndriver\nrmf: {}\n": (
        "3:1: a key without ': ' after it, or a line indented wrongly"
    ),
    "kind: 'gate\n": "2:1: the file ends inside a text: its closing quote is missing",
    "kind: gate\n---\nkind: gate\n": (
        "2:1: a second document ('---') starts here: a file describes one daemon, so split the file"
    ),
    "kind: [a, b\nc: d\n": ("2:2: a ',' is missing here, or the '[' of line 1 is not closed"),
    "kind: gate\n- a\n": (
        "2:1: not YAML: expected <block end>, but found '-' (while parsing a block mapping, "
        "from line 1)"
    ),
    "a: @b\n": "1:4: a text that begins with @ needs quotes",
    'a: "\\q"\n': "1:6: not YAML: found unknown escape character 'q'"
    " (while scanning a double-quoted scalar, from line 1)",
    'a: "\\Uffffffff"\n': (
        "1:7: not YAML: a number too large, in an escape ('\\U...') or a directive ('%YAML')"
    ),
    "%YAML 2.0\n---\na: 1\n": (
        "1:1: not YAML: found incompatible YAML document (version 1.* is required)"
    ),
    "a: *b\n": "1:4: not YAML: found undefined alias 'b'",
    "a: &b 1\nc: &b 2\n": "2:4: an anchor ('&name') whose name is already used",
}


@pytest.mark.parametrize("text", SYNTAX)
def test_a_syntax_mistake_is_reported_with_line_and_column(file: Path, text: str) -> None:
    assert problems_of(file, text) == [SYNTAX[text]]


def test_every_tag_is_refused_at_any_place(file: Path) -> None:
    text = RIGHT.replace("dds,", "!!python/object:os.system dds,").replace("[in,", "[! in,")
    refused = "a tag ('!...') is not accepted: delete it, or quote the text"
    assert problems_of(file, text) == [f"3:18: {refused}", f"8:13: {refused}"]


def test_an_alias_repeats_what_its_anchor_holds(file: Path) -> None:
    text = RIGHT.replace("lanes: [in, out]", "lanes: [&i in, &o out]")
    text = text.replace("{1: in, 2: out}", "{1: *i, 2: *o}")
    assert config_of(file, text).devices == config_of(file, RIGHT).devices


@pytest.mark.parametrize(
    "text", ["a: &x [1, *x]\n", "a: &x {b: {c: *x}}\n", "&x a: 1\n? *x\n: 2\n"]
)
def test_an_alias_inside_its_own_value_does_not_block_the_loader(file: Path, text: str) -> None:
    assert len(problems_of(file, text)) >= 1


def test_an_alias_inside_its_own_value_is_one_problem(file: Path) -> None:
    assert problems_of(file, "a: &x\n  b: [1, *x]\n") == [
        "2:10: an alias ('*name') inside the value that it repeats"
    ]


def test_aliases_cannot_make_a_small_file_huge(file: Path) -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    assert problems_of(file, "\n".join(lines)) == [
        "5:5: more than 20000 values, counting repeated aliases"
    ]


@pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "? ", "[{a: "])
def test_a_deeply_nested_file_is_one_problem(file: Path, opening: str) -> None:
    (problem,) = problems_of(file, opening * 5_000)
    assert problem.startswith("1:")
    assert problem.endswith(": nested more than 32 deep")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("rmf_fleet: {name: tiny}\nother: 1\n", "a fleet adapter's configuration"),
        ("other: 1\nlevels: {L1: {}}\n", "RMF's building map or navigation graph"),
    ],
)
def test_a_file_of_rmf_is_recognised_and_the_text_names_its_option(
    file: Path, text: str, says: str
) -> None:
    (found,) = problems_of(file, text)
    assert f"this is {says}, and no device YAML: rmf-bridge check DEVICE.yaml --" in found


@pytest.mark.parametrize("where", ["value", "key"])
def test_half_of_a_character_is_refused_at_its_place(tmp_path: Path, where: str) -> None:
    file = tmp_path / "a.yaml"
    half = '"\\ud800"'
    text = f"kind: {half}\n" if where == "value" else f"kind: lift\n{half}: 1\n"
    place = "1:7" if where == "value" else "2:1"
    said = "holds half a character (\\ud800 to \\udfff): write the whole character"
    assert problems_of(file, text) == [f"{place}: {said}"]

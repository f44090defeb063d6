"""Parses YAML text to nodes with line and column. It refuses invalid YAML, and some features of valid
YAML.

PyYAML's pure Python loader is used for two reasons. Its messages say more than libyaml's. A deeply
nested file would crash libyaml, because libyaml's composer recurses in C without a limit.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import cast

import yaml
from msgspec import Struct
from yaml import AliasEvent, MappingNode, Mark, MarkedYAMLError, Node, ScalarNode, SequenceNode
from yaml.reader import ReaderError

from bridges.messages.words import printable
from bridges.system import user_files
from bridges.yaml import typo_hints
from bridges.yaml.problems import Problem as Problem
from bridges.yaml.problems import SettingsError as SettingsError

MAX_DEPTH = 32
HALVES = re.compile("[\ud800-\udfff]")
"""A pattern for surrogates. A surrogate is one half of a UTF-16 pair, and cannot be encoded in
UTF-8."""


class Sort(Struct, frozen=True):
    """One sort of file.

    `name`: the sort's name in messages. `begins`: an example of the first line. `max_bytes`: the
    greatest size. `max_values`: the greatest number of values.
    """

    name: str
    begins: str
    max_bytes: int
    max_values: int


DEVICE = Sort("device YAML", "kind: ...", 256 * 1024, 20_000)


class YamlFile:
    """One file, with the problems found so far."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.problems: list[Problem] = []

    def problem(self, where: Node | Mark | None, text: str) -> Problem:
        """Return a problem at the start of a node. Control characters in the text are escaped, because
        the text may quote any part of the file."""
        mark = where.start_mark if isinstance(where, Node) else where
        if mark is None:
            return Problem(self.file, 1, 1, printable(text))
        return Problem(self.file, mark.line + 1, mark.column + 1, printable(text))

    def note(self, where: Node | Mark, text: str) -> None:
        """Record a problem, so that the reading can continue."""
        self.problems.append(self.problem(where, text))

    def check(self) -> None:
        """Raise SettingsError if a problem was recorded."""
        if self.problems:
            raise SettingsError(self.problems)


class _Refused(MarkedYAMLError):
    """The error for YAML that is valid, but that we do not accept."""

    def __init__(self, mark: Mark, text: str) -> None:
        super().__init__(None, None, text, mark)


class _Composer(yaml.SafeLoader):
    """A composer with limits. It refuses tags and recursive aliases."""

    def __init__(self, text: str, page: YamlFile, max_values: int) -> None:
        super().__init__(text)
        self._page = page
        self._max_values = max_values
        self._depth = 0
        self._count = 0
        self._sizes: dict[int, int] = {}

    def compose_node(self, parent: Node | None, index: int) -> Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        mark = cast(Mark, event.start_mark)
        if getattr(event, "tag", None) is not None:
            self._page.note(mark, "a tag ('!...') is not accepted: delete it, or quote the text")
        self._count += 1
        self._refuse_more_than_most(mark, self._count)
        with self._deeper(mark):
            node = super().compose_node(parent, index)
        if isinstance(event, AliasEvent) and id(node) not in self._sizes:
            raise _Refused(mark, "an alias ('*name') inside the value that it repeats")
        self._sizes[id(node)] = size = 1 + sum(self._sizes[id(n)] for n in _children(node))
        self._refuse_more_than_most(mark, size)
        if isinstance(node, ScalarNode) and HALVES.search(node.value):
            raise _Refused(
                mark, "holds half a character (\\ud800 to \\udfff): write the whole character"
            )
        if (
            isinstance(node, ScalarNode)
            and is_plain(node)
            and (odd := typo_hints.odd_space(node.value))
        ):
            self._page.note(node, odd)
            node.value = typo_hints.cleaned(node.value)
        return node

    def _refuse_more_than_most(self, mark: Mark, values: int) -> None:
        if values > self._max_values:
            raise _Refused(mark, f"more than {self._max_values} values, counting repeated aliases")

    @contextmanager
    def _deeper(self, mark: Mark) -> Iterator[None]:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise _Refused(mark, f"nested more than {MAX_DEPTH} deep")
        yield
        self._depth -= 1


def _children(node: Node | None) -> Iterator[Node]:
    if isinstance(node, SequenceNode):
        yield from node.value
    elif isinstance(node, MappingNode):
        for pair in node.value:
            yield from pair


def read(file: str, sort: Sort = DEVICE) -> bytes:
    """Read the file's bytes. Raises SettingsError if the file is unreadable or too long."""
    try:
        text = user_files.read(file, sort.max_bytes).content
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SettingsError([Problem(file, 1, 1, f"cannot be read: {reason}")]) from None
    if len(text) > sort.max_bytes:
        reason = f"longer than {sort.max_bytes // 1024} KiB: this is not a {sort.name}"
        raise SettingsError([Problem(file, 1, 1, reason)])
    return text


def compose(page: YamlFile, text: bytes, sort: Sort = DEVICE) -> MappingNode:
    """Return the file's top-level mapping. Raises SettingsError if the file has no such mapping."""
    root = _root(page, _decoded(page, text), sort)
    if not isinstance(root, MappingNode):
        found = "empty" if root is None else "not a mapping"
        page.problems.append(
            Problem(page.file, 1, 1, f"the file is {found}: begin it with '{sort.begins}'")
        )
        raise SettingsError(page.problems)
    return root


def _decoded(page: YamlFile, text: bytes) -> str:
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError as error:
        before = error.object[: error.start].decode()
        reason = f"byte 0x{error.object[error.start]:02x} is not UTF-8: save the file as UTF-8"
        raise SettingsError([_problem_after(page, before, reason)]) from None


def _root(page: YamlFile, text: str, sort: Sort) -> Node | None:
    composer = None
    try:
        composer = _Composer(text, page, sort.max_values)
        return composer.get_single_node()
    except ReaderError as error:
        reason = f"the character U+{error.character:04X} is not allowed in YAML: delete it"
        raise SettingsError([_problem_after(page, text[: error.position], reason)]) from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        told = str(error.problem) if isinstance(error, _Refused) else typo_hints.reason(error, text)
        raise SettingsError([*page.problems, page.problem(mark, told)]) from None
    except (ValueError, OverflowError):
        # PyYAML raises these errors for numbers that it cannot convert. One is the number of a
        # character that does not exist, as in "\U00110000". The other is a number in a %YAML directive.
        assert composer is not None
        reason = "not YAML: a number too large, in an escape ('\\U...') or a directive ('%YAML')"
        raise SettingsError([page.problem(composer.get_mark(), reason)]) from None


def _problem_after(page: YamlFile, before: str, text: str) -> Problem:
    lines = re.split(r"\r\n|\r|\n", before)
    return Problem(page.file, len(lines), len(lines[-1]) + 1, text)


def is_plain(node: ScalarNode) -> bool:
    """Return whether the scalar is written without quotes. YAML then derives its type from its text."""
    return node.style is None

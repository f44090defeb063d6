"""The expected texts (`expected.toml`), and a function that compares the printed text with them. The
printed text is called the screen."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import msgspec

FILE: Final = Path(__file__).parent / "expected.toml"
STEP: Final = re.compile(r"^Next, (?:.|\n  )*", re.MULTILINE)
"""A pattern for one next step in a printed text. The step may have several lines."""
Alternatives = list[str]


class Rule(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A rule for every next step in a printed text. A step with a phrase of `when_next` must also have
    a phrase of `needs`."""

    when_next: Alternatives
    needs: Alternatives


class Verdict(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One trouble of the file.

    The screen needs one phrase from each list in `says`. Its next steps need one phrase from each list
    in `next_says`. The phrases in `never` and `next_never` must not occur.
    """

    name: str
    view: str
    device: str
    story: str
    at_fault: str
    acts: str
    do: str
    says: list[Alternatives]
    next_says: list[Alternatives]
    never: Alternatives
    why: str
    next_never: Alternatives = []

    @property
    def key(self) -> tuple[str, str, str]:
        """The name of the entry: (trouble, view, device)."""
        return self.name, self.view, self.device


class _File(msgspec.Struct, forbid_unknown_fields=True):
    rule: list[Rule]
    trouble: list[Verdict]


_READ: Final = msgspec.toml.decode(FILE.read_bytes(), type=_File)
VERDICTS: Final = _READ.trouble
RULES: Final = _READ.rule


def wrong(verdict: Verdict, screen: str, names: Mapping[str, str]) -> list[str]:
    """Return the differences between a screen and the verdict. `names` fills the places in braces."""
    steps = STEP.findall(screen)
    return list(_wrong(verdict, _plain(screen), [_plain(step) for step in steps], names))


def _wrong(
    verdict: Verdict, told: str, steps: list[str], names: Mapping[str, str]
) -> Iterator[str]:
    def named(phrases: Alternatives) -> Alternatives:
        return [_plain(phrase.format_map(names)) for phrase in phrases]

    following = " ".join(steps) or told  # the screen of `release` has no next step
    if steps and not steps[0].startswith(f"next, {verdict.acts}:"):
        yield f"acts: {verdict.acts}, not {steps[0].partition(':')[0]!r}"
    for what, text, wanted in (
        ("says", told, verdict.says),
        ("next_says", following, verdict.next_says),
    ):
        for phrases in wanted:
            if not any(phrase in text for phrase in named(phrases)):
                yield f"{what}: one of {named(phrases)}"
    for what, text, unwanted in (
        ("never", told, verdict.never),
        ("next_never", following, verdict.next_never),
    ):
        yield from (f"{what}: {phrase!r}" for phrase in named(unwanted) if phrase in text)
    for rule in RULES:
        found = [phrase for phrase in rule.when_next if phrase in following]
        if found and not any(phrase in following for phrase in rule.needs):
            yield f"rule: {found[0]!r} needs one of {rule.needs}"


def _plain(text: str) -> str:
    return " ".join(text.lower().split())

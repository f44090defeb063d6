"""`python -m tests.reference.pages` writes the generated pages of docs/.

The generated pages are docs/reference/, the index of decisions and the table of hazards.
`test_pages.py` compares each page with its file.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Final

from bridges import cli
from bridges.exit_codes import ALWAYS, EXIT_CODES
from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.alarming import alarm_topics
from bridges.kinds.shared.kind import Kind
from bridges.messages import topics
from bridges.runtime import faults
from bridges.settings.config import Config
from bridges.settings.load import load
from tests.reference import alerts, hazards, promised
from workbench.commands import schema
from workbench.commissioning.examples import device_yamls
from workbench.judge.judge import KINDS
from workbench.judge.report import markdown

DOCS: Final = Path(__file__).parents[2] / "docs"
DECISIONS: Final = DOCS / "explanation" / "decisions"


def commands() -> str:
    """Return the page of subcommands with their options, made from the parsers."""
    whole = next(_subparsers(cli.whole_parser()))
    told = "".join(_command(f"rmf-bridge {name}", whole[name]) for name in cli.COMMANDS)
    rows = (
        f"| [`{name}`](#rmf-bridge-{name}) | {text} |" for name, (text, _) in cli.COMMANDS.items()
    )
    return (
        "# Commands\n\nOne command, `rmf-bridge`, with these subcommands."
        " `rmf-bridge COMMAND --help` and `man rmf-bridge` print the same.\n\n"
        "| command | what it does |\n|---|---|\n" + "\n".join(rows) + "\n" + told
    )


def _subparsers(parser: argparse.ArgumentParser) -> Iterator[dict[str, argparse.ArgumentParser]]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield dict(action.choices)


def _command(name: str, parser: argparse.ArgumentParser) -> str:
    text = (parser.description or "").partition("\n")[0].partition(" Exit codes:")[0]
    rows = [row for action in parser._actions for row in _row(parser, action)]
    example = (parser.epilog or "").removeprefix("example: ")
    table = "\n| | |\n|---|---|\n" + "\n".join(rows) + "\n" if rows else ""
    told = f"\n{'##' if name.count(' ') == 1 else '###'} {name}\n{_cell(text)}\n{table}"
    if example:
        told += f"\n```\n{example}\n```\n"
    for choices in _subparsers(parser):
        told += "".join(_command(f"{name} {one}", inner) for one, inner in choices.items())
    return told


def _row(parser: argparse.ArgumentParser, action: argparse.Action) -> Iterator[str]:
    if action.help == argparse.SUPPRESS or isinstance(
        action, (argparse._HelpAction, argparse._SubParsersAction)
    ):
        return
    formatter = argparse.HelpFormatter(parser.prog)
    value = "" if action.nargs == 0 else formatter._format_args(action, _metavar(action))
    spelled = ", ".join(action.option_strings)
    yield f"| `{_cell(' '.join(filter(None, (spelled, value))))}` | {_cell(_help(parser, action))} |"


def _metavar(action: argparse.Action) -> str:
    if isinstance(action.metavar, str):
        return action.metavar
    if action.choices is not None:
        return "{" + ",".join(map(str, action.choices)) + "}"
    return action.dest.upper()


def _help(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    return (action.help or "") % {**vars(action), "prog": parser.prog}


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def exit_codes() -> str:
    """Return the page of each subcommand's exit codes."""
    always = "\n".join(f"| {code} | {text} |" for code, text in ALWAYS.items())
    rows = (
        f"| `{name}` | {code} | {text} |"
        for name in cli.COMMANDS
        for code, text in EXIT_CODES[name].items()
    )
    return (
        "# Exit codes\n\nFor scripts and monitoring. The codes from 64 on are those of `sysexits.h`."
        " Each command may also end with one of these codes:\n\n"
        f"| code | meaning |\n|---|---|\n{always}\n\n"
        "| command | code | meaning |\n|---|---|---|\n" + "\n".join(rows) + "\n"
    )


def laws() -> str:
    """Return the page of the laws of `rmf-bridge judge`."""
    return LAWS_HEAD + "".join(f"\n## Of {OF[kind]}\n\n{markdown(kind)}\n" for kind in KINDS)


OF: Final = {
    "lift": "a lift",
    "door": "a door",
    "charger": "a charger",
    "dispenser": "a dispenser",
    "ingestor": "an ingestor",
    "adapter": "a fleet's adapter",
    "alarm": "a node's alarm",
}
LAWS_HEAD: Final = """\
# Laws

Laws are what RMF's supervisors and fleet adapters need from any node for a lift, door, charger,
dispenser or ingestor, and what lifts and doors need from a fleet's adapter. `rmf-bridge judge` checks
whether a node keeps them ([how](../how-to/judge.md)). `rmf-bridge judge KIND --laws` prints them. Even
a correct node can break a law marked with \\* if one of its wires is stuck or noisy.

No part of RMF sends ChargerRequest, and RMF has no names for its topics: `charger_states`,
`charger_requests` and `charger_cancels` are ours (`topics:` in a YAML given by `--config` renames
them). The laws of a charger rest on the messages' own texts. Line numbers are those of rmf_ros2 9dedd0f
(2026-05-14) and rmf_internal_msgs 3d4df02 (4.1.0); Jazzy's messages of lifts, doors and chargers are
the same.
"""


def every_topic() -> str:
    """Return the page of topics, with the kinds that publish or subscribe to each topic."""
    sent: dict[str, set[str]] = {topics.DIAGNOSTICS.name: {"every daemon"}}
    heard: dict[str, set[str]] = {}
    examples = [load(file) for file in device_yamls()]
    for name in kind_names():
        kind = kind_called(name)
        shown = name.replace("_", " ")
        for topic in (*kind.requests, *(kind.recorded if isinstance(kind, Kind) else ())):
            heard.setdefault(topic.name, set()).add(shown)
        for topic in _published(name, examples):
            sent.setdefault(topic.name, set()).add(shown)
    rows = (
        f"| `{one.name}` | {one.type.__name__} | {_durability(one.publish)} |"
        f" {_durability(one.subscribe)} | {_names(sent.get(one.name, ()))} |"
        f" {_names(heard.get(one.name, ()))} |"
        for one in topics.every()
    )
    return TOPICS_HEAD + "\n".join(rows) + "\n"


TOPICS_HEAD: Final = """\
# Topics

Every ROS topic of our daemons, its message and QoS. All are RELIABLE with KEEP_LAST history. A retained
topic is TRANSIENT_LOCAL: whoever joins later gets its last messages. `rmf: {topics: …}` renames topics
([configuration](configuration.md)). With `alarm:` a lift publishes `fire_alarm_trigger` or
`emergency_signal`.

| topic | message | published | subscribed | a daemon that publishes it | that obeys or hears it |
|---|---|---|---|---|---|
"""


def _published(name: str, examples: Iterable[Config]) -> Iterator[topics.AnyTopic]:
    kind = kind_called(name)
    if not isinstance(kind, Kind):
        yield from (*kind.publishes, *kind.sole)
        return
    yield from kind.stated_on
    for config in examples:
        if config.kind == name:
            for device in config.devices.values():
                yield from (*kind.publishes(device), *alarm_topics(device))


def _durability(qos: topics.Qos) -> str:
    kept = "retained" if qos.durability == "transient_local" else "volatile"
    return f"{kept}, {qos.depth}"


def _names(kinds: Iterable[str]) -> str:
    return ", ".join(sorted(kinds))


def decisions() -> str:
    """Return the index of docs/explanation/decisions/."""
    rows = []
    for file in sorted(DECISIONS.glob("0*.md")):
        title, _, status, *_ = file.read_text().splitlines()
        day, _, state = status.partition(" · ")
        rows.append(f"| [{file.name[:4]}]({file.name}) | {title[2:]} | {day} | {state} |")
    return DECISIONS_HEAD + "\n".join(rows) + "\n"


DECISIONS_HEAD: Final = """\
# Decisions

Decisions that cost something to reverse, with date and reason. A new decision gets the next number. Its
second line has its date and its status: proposed, accepted, or replaced by another. The texts of old
decisions are not changed, so a file that they name may have moved since ([0116](0116-two-houses.md)).

| | decision | date | status |
|---|---|---|---|
"""

PAGES: Final[dict[str, Callable[[], str]]] = {
    "reference/commands.md": commands,
    "reference/configuration.md": schema.markdown,
    "reference/exit-codes.md": exit_codes,
    "reference/faults.md": faults.page,
    "reference/laws.md": laws,
    "reference/topics.md": every_topic,
    "explanation/decisions/index.md": decisions,
    "explanation/hazards.md": hazards.page,
    "../deploy/prometheus/rmf-bridges.rules.yaml": alerts.page,
}

if __name__ == "__main__":
    for page, text in PAGES.items():
        (DOCS / page).write_text(text())
    promised.add()

"""`--help` gives an example for each command, and each example is a valid command line."""

import argparse
import shlex

import pytest

from bridges import cli
from workbench.commissioning.init.answers import LIFT_INPUTS


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_the_help_of_each_command_ends_with_an_example(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        cli.main([command, "--help"])
    assert left.value.code == 0
    words = " ".join(capsys.readouterr().out.split())
    assert words.endswith(f"example: rmf-bridge {cli.COMMANDS[command][1]}")


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_each_example_is_a_valid_command_line(command: str) -> None:
    name, *arguments = shlex.split(cli.COMMANDS[command][1], comments=False)
    assert name == command
    if ">" in arguments:
        arguments = arguments[: arguments.index(">")]
    parser = argparse.ArgumentParser()
    module = cli._module(command)
    module.add_arguments(parser)
    parser.parse_args(arguments)


@pytest.mark.parametrize(
    ("line", "usage", "unknown"),
    [
        ("send door ward open --session me", "send door", "--session me"),
        ("press lift.yaml --device Lift1 hall_L2 on", "press", "hall_L2 on"),
        ("status --frequency 2 lift", "status", "--frequency lift"),
    ],
)
def test_an_unknown_option_is_answered_with_the_usage_of_the_command(
    line: str, usage: str, unknown: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        cli.main(shlex.split(line))
    told = capsys.readouterr().err
    assert left.value.code == 2
    assert told.startswith(f"usage: rmf-bridge {usage} [-h] ")
    assert told.endswith(f"rmf-bridge {usage}: error: unrecognized arguments: {unknown}\n")


@pytest.mark.parametrize("kind", ["lift", "door", "charger"])
def test_the_help_of_each_request_ends_with_an_example(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        cli.main(["send", kind, "--help"])
    words = " ".join(capsys.readouterr().out.split())
    assert f"example: rmf-bridge send {kind} " in words


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("chek", "error: argument COMMAND: there is no 'chek'; did you mean 'check'?"),
        ("send lft", "there is no 'lft'; did you mean 'lift'?"),
        (
            "fail lift.yaml car stuk",
            "error: argument mode: there is no 'stuk'; did you mean 'stuck'?",
        ),
        ("xyzzy", "invalid choice: 'xyzzy' (choose from "),
    ],
)
def test_a_misspelt_word_is_answered_with_the_right_word(
    line: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        cli.main(line.split())
    assert left.value.code == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_no_word_of_a_help_is_broken(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        cli.main(["init", "--help"])
    said = capsys.readouterr().out.replace(",", " ").split()
    assert {*LIFT_INPUTS} <= {*said}

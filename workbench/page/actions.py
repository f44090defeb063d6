"""The actions of a logged-in user, and the actions' commands.

The page has no rights and no topics of its own. Each action is a command of this program. The command
runs as the page's user, as if this user had typed the command in a shell on this machine. A log records
each action with the logged-in user.

Names come from the network, and a name may look like an option. Therefore a command line writes
`--option=value`, and puts names after `--`.
"""

import asyncio
import json
import logging
import os
import re
import sys
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridges.kinds.charger_coordinator.memory import NODE
from bridges.messages import definitions as d
from bridges.messages.words import printable
from bridges.system.log import pairs
from workbench.page.live_site import DeviceView

log = logging.getLogger(__name__)

TIMEOUT_S: Final = 30.0
WAITS: Final = "--timeout=20"
MOST_OUTPUT: Final = 16 * 1024
MOST_KEPT: Final = 100
LONGEST_FILE: Final = 1_000_000
MOST_NAMED: Final = 10
AGAIN: Final = (
    "But the charger coordinator requests a charge again, within seconds, as long as the robot needs"
    " one. To stop this, give the robot a task in RMF, or stop the coordinator."
)
RESET: Final = "The daemon clears each latched fault whose cause is gone."
REPORTS: Final = re.compile(r"^rmf-bridge \S+: ", re.M)
"""Pattern of the beginning of an error message, which is the command's name."""
PROGRESS: Final = re.compile(r"^[\d.]+ s  \S+ +\S.*?  ")
"""Pattern of the beginning of a line from `send`: the time, the step and the device."""


@dataclass(frozen=True, slots=True)
class Action:
    """A button's text, the question that asks for confirmation, and the words of the command.

    `done` is the sentence that reports success. If `done` is "", the command's last line is the report.
    """

    text: str
    question: str
    words: tuple[str, ...]
    done: str = ""


@dataclass(frozen=True, slots=True)
class Local:
    """A daemon on this machine that serves the device.

    `file` is the daemon's YAML, which has all these `devices`. `alarms` means that the daemon can raise
    an alarm that stops robots. If the daemon runs a simulation, `presses` has the signals that can be
    pressed, and `fails` has the parts that can fail. Otherwise both are empty.
    """

    file: str
    devices: tuple[str, ...]
    alarms: bool = False
    presses: tuple[str, ...] = ()
    fails: tuple[str, ...] = ()
    runtime: str = ""


@dataclass(frozen=True, slots=True)
class PastAction:
    """One past action. `code` is the command's exit code, or None if the command took too long. `done`
    has the same meaning as in Action."""

    wall: float
    user: str
    text: str
    code: int | None
    said: str
    done: str = ""

    @property
    def came(self) -> str:
        """Describe the outcome of the action in a few sentences."""
        if self.code is None:
            return f"{self.text}: no answer within {TIMEOUT_S:.0f} s. Check what the device does."
        if self.code:
            why = _sentence(REPORTS.sub("", self.said)) or f"Its exit code is {self.code}."
            return f"{self.text}: not done. {why}"
        lines = [*filter(None, map(str.strip, self.said.splitlines())), ""]
        told = self.done or _sentence(PROGRESS.sub("", lines[-2] if lines[1:] else ""))
        return f"{self.text}: done. {told}".strip()


def _sentence(text: str) -> str:
    text = " ".join(text.split()).rstrip(".")
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def actions(view: DeviceView, local: Local | None, graph: Sequence[str]) -> list[Action]:
    """Return this device's actions. `graph` has the options that name the page's graph."""
    found = [*_on_graph(view, graph)]
    if local is not None:
        words = ("reset", *_runtime(local), "--", local.file)
        found.append(Action("Reset faults", _reset_question(local), words, RESET))
    return found


def _reset_question(local: Local) -> str:
    """Return the question before a reset. A reset always concerns the whole daemon."""
    names = ", ".join(map(printable, local.devices[:MOST_NAMED]))
    more = len(local.devices) - MOST_NAMED
    every = f"{names} and {more} more" if more > 0 else names
    question = (
        f"Clear each latched fault whose cause is gone, on every device of the daemon: {every}?"
    )
    if not local.alarms:
        return question
    return (
        f"{question} This also ends the daemon's alarm for the fleets, if its causes are gone."
        " Then robots that only this alarm stops drive on."
    )


def _on_graph(view: DeviceView, graph: Sequence[str]) -> list[Action]:
    match view.state:
        case d.LiftState(lift_name=name, session_id=session) if session:
            who = printable(session)
            return [
                Action(
                    "Release the lift",
                    f"End the session of {who}? A robot that is in the car may be left there.",
                    ("release", f"--session={session}", WAITS, *graph, "--", name),
                )
            ]
        case d.ChargerState(charger_name=name, request_id=request) if request:
            ours = request.startswith(f"{NODE}/")
            question = f"Cancel request {printable(request)}? The robot has to leave the pad."
            return [
                Action(
                    "Cancel the charge",
                    f"{question} {AGAIN}" if ours else question,
                    ("send", "charger", f"--cancel={request}", WAITS, *graph, "--", name),
                    f"The charger no longer serves the request. {AGAIN}" if ours else "",
                )
            ]
        case _:
            return []


def queue(name: str, robot: str, graph: Sequence[str]) -> Action:
    """Return the action that asks the coordinator for a charge. `robot` is FLEET/ROBOT."""
    words = ("send", "charger", "--queue", f"--robot={robot}", WAITS, *graph, "--", name)
    return Action("Queue a charge", f"Ask for a charge of {printable(robot)}?", words)


def press(local: Local, device: str, signal: str, on: bool) -> Action:
    """Return the action that switches a signal of a simulation on or off."""
    how = "on" if on else "off"
    words = ("press", f"--device={device}", *_runtime(local), "--", local.file, signal, how)
    did = f"In the simulation {signal} of {printable(device)} is {how}."
    act = "Press" if on else "Let go of"
    return Action(f"{act} {signal}", f"{act} {signal}, in the simulation?", words, did)


def fail(local: Local, device: str, part: str, how: str) -> Action:
    """Return the action that makes a part of a simulation fail. `how` is the failure's mode. The mode
    `ok` mends the part."""
    words = ("fail", f"--device={device}", *_runtime(local), "--", local.file, part, how)
    did = f"In the simulation {part} of {printable(device)} is {how}."
    act = f"Mend {part}" if how == "ok" else f"Let {part} fail"
    return Action(act, f"{act} ({how}), in the simulation?", words, did)


def _runtime(local: Local) -> tuple[str, ...]:
    return (f"--runtime-dir={local.runtime}",) if local.runtime else ()


class Deeds:
    """A runner of actions that remembers each action with its user."""

    def __init__(self, folder: Path | None) -> None:
        """Make a runner. `folder` is the folder for `actions.jsonl`. If `folder` is None, no file is
        written."""
        self._file = folder / "actions.jsonl" if folder else None
        self.latest: deque[PastAction] = deque(maxlen=MOST_KEPT)

    async def do(self, action: Action, user: str) -> PastAction:
        """Run the action's command. Never raises, because `said` in the result has the error."""
        code, said = await _run(action.words)
        done = PastAction(time.time(), user, action.text, code, said, action.done)
        self.latest.appendleft(done)
        command = " ".join(("rmf-bridge", *action.words))
        log.info(pairs("action", user=user, command=command, exit=code))
        self._write(done, action.words)
        return done

    def _write(self, done: PastAction, words: Sequence[str]) -> None:
        if self._file is None:
            return
        line = {"at": round(done.wall, 3), "user": done.user, "exit": done.code, "command": words}
        with suppress(OSError):
            if self._file.exists() and self._file.stat().st_size > LONGEST_FILE:
                self._file.replace(self._file.with_suffix(".jsonl.1"))
            with self._file.open("a", encoding="utf-8") as out:
                out.write(json.dumps(line) + "\n")


async def _run(words: Sequence[str]) -> tuple[int | None, str]:
    """Run a command. Return its exit code, or None after the time limit. Also return the beginning of
    the output."""
    try:
        child = await asyncio.create_subprocess_exec(
            sys.executable,
            "-P",
            "-m",
            "bridges.cli",
            *words,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )
    except OSError as error:
        return os.EX_OSERR, str(error)
    try:
        said, _ = await asyncio.wait_for(child.communicate(), TIMEOUT_S)
    except TimeoutError:
        child.terminate()
        said, _ = await child.communicate()
        return None, said[:MOST_OUTPUT].decode(errors="replace")
    return child.returncode, said[:MOST_OUTPUT].decode(errors="replace")

"""`rmf-bridge judge` as a process on DDS and on zenoh. The process judges our own daemons and other
nodes."""

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from bridges.kinds.shared.rmf_section import Rmf
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.topics import AnyTopic
from bridges.transports.choose import open_transport
from bridges.transports.transport import Publisher
from hal_fakes.wire import Wire, runs_here
from tests.waiting import PATIENCE_S, wait_until
from tests.workbench.judge.nodes.right_lift import RightLift
from tests.workbench.judge.nodes.wrong_lift import FireIsVolatile, LiftAnswers
from workbench.rmf_model import Party

CONFIG = Path(__file__).parents[3] / "config"


@pytest.fixture(params=sorted({runs_here(), "zenoh"}))
def speaks(request: pytest.FixtureRequest) -> Wire:
    """Return the transport that the node and the judge use."""
    speaks: Wire = request.param
    return speaks


@contextmanager
def bridge(*words: str, speaks: Wire, domain: int) -> Iterator[subprocess.Popen[str]]:
    """Run an `rmf-bridge` process until the `with` block ends."""
    line = [sys.executable, "-m", "bridges.cli", *words, "--domain-id", str(domain)]
    process = subprocess.Popen(
        [*line, "--transport", speaks],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)


@contextmanager
def served(party: Party, speaks: Wire, domain: int) -> Iterator[list[d.Message]]:
    """Run a node in real time. Yield the list of requests that the node has received."""
    node = open_transport(Rmf(transport=speaks, domain_id=domain), "node", localhost=True)
    publishers: dict[AnyTopic, Publisher[d.Message]] = {}
    asked: list[d.Message] = []
    lock, ended = threading.Lock(), threading.Event()

    def do(what: Any, *arguments: Any) -> None:
        with lock:
            for topic, message in what(*arguments, time.time()):
                if topic not in publishers:
                    publishers[topic] = node.publisher(topic)
                publishers[topic].publish(message)

    def hear(message: d.Message) -> None:
        asked.append(message)
        do(party.hear, message)

    def live() -> None:
        while not ended.wait(0.05):
            if time.time() >= party.wake_at():
                do(party.tick)

    for topic in party.subscribes:
        node.subscribe(topic, hear)
    thread = threading.Thread(target=live)
    thread.start()
    try:
        yield asked
    finally:
        ended.set()
        thread.join()
        node.close()


def verdict(process: subprocess.Popen[str]) -> tuple[int, set[str], list[str]]:
    """Return the exit code, the broken laws, and the notes."""
    out, error = process.communicate(timeout=PATIENCE_S)
    assert [line for line in error.splitlines() if not line.startswith("misfit")] == []
    told = json.loads(out)
    broken = {law["id"] for law in told["laws"] if law["verdict"] == "broken"}
    return process.returncode, broken, told["notes"]


@pytest.mark.long(80)
@pytest.mark.parametrize(
    ("file", "words", "speaks"),
    [
        *(
            ("lift_dry_contact", ["lift", "Lift1", "--ride", "L1", "L2", "--restarts"], speaks)
            for speaks in sorted({runs_here(), "zenoh"})
        ),
        ("door_modbus", ["door", "ward_door", "--passages", "1"], runs_here()),
        ("charger_http", ["charger", "charger_a", "--charge", "--robot", "fleet/AMR01"], "zenoh"),
    ],
)
def test_our_own_daemons_keep_every_law(
    file: str, words: list[str], speaks: Wire, domain: int, tmp_path: Path
) -> None:
    run = [
        "run",
        str(CONFIG / f"{file}.yaml"),
        "--simulate",
        "--runtime-dir",
        str(tmp_path / "run"),
    ]
    judge = ["judge", *words, "--active", "--json", "--localhost"]
    with (
        bridge(*run, speaks=speaks, domain=domain),
        bridge(*judge, speaks=speaks, domain=domain) as process,
    ):
        assert verdict(process) == (0, set(), [])


@pytest.mark.long(14)
def test_a_volatile_fire_alarm_is_found_by_its_qos(speaks: Wire, domain: int) -> None:
    watch = ["judge", "lift", "Lift1", "--for", "6", "--json", "--localhost"]
    with (
        served(FireIsVolatile(), speaks, domain),
        bridge(*watch, speaks=speaks, domain=domain) as process,
    ):
        assert verdict(process) == (1, {"L12.retained"}, [])


@pytest.mark.long(14)
def test_a_judge_that_is_told_to_end_ends_its_session_first(speaks: Wire, domain: int) -> None:
    number = signal.SIGTERM if speaks == "zenoh" else signal.SIGINT
    ride = ["judge", "lift", "Lift1", "--active", "--ride", "L1", "L3", "--json", "--localhost"]
    node = RightLift()
    with served(node, speaks, domain), bridge(*ride, speaks=speaks, domain=domain) as process:
        wait_until(lambda: node.session == "rmf_bridge_judge/robot1", "it has the lift")
        process.send_signal(number)
        code, broken, notes = verdict(process)
        assert (code, broken, notes) == (69, set(), ["not played to its end: interrupted"])
        assert node.session == ""


@pytest.mark.long(20)
def test_a_node_that_answers_each_request_floods_nobody(speaks: Wire, domain: int) -> None:
    """Check that the judge stops its requests. Otherwise the node and the judge would answer each other
    without end."""
    ride = ["judge", "lift", "Lift1", "--active", "--ride", "L1", "L3", "--json", "--localhost"]
    with (
        served(LiftAnswers(), speaks, domain) as asked,
        bridge(*ride, speaks=speaks, domain=domain) as process,
    ):
        code, broken, notes = verdict(process)
        assert (code, broken) == (1, {"L2.answer"})
        assert notes == [
            "not played to its end: stopped: each request causes a state, and RMF sends a"
            " request after each state"
        ]
        assert len(asked) < 2000


def test_other_speakers_are_named_with_the_option_that_permits_them(
    speaks: Wire, domain: int
) -> None:
    ride = ["judge", "lift", "Lift1", "--active", "--ride", "L1", "L3", "--json", "--localhost"]
    node = open_transport(Rmf(transport=speaks, domain_id=domain), "supervisor", localhost=True)
    node.publisher(topics.LIFT_REQUESTS)
    try:
        with (
            served(RightLift(), speaks, domain) as asked,
            bridge(*ride, speaks=speaks, domain=domain) as process,
        ):
            code, _, notes = verdict(process)
    finally:
        node.close()
    assert (code, asked) == (69, [])
    assert notes == [
        "not played to its end: other nodes publish on lift_requests; to play nevertheless,"
        " add --beside supervisor"
    ]

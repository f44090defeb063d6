"""The certificates and the access control of docs/how-to/harden.md, tried on 127.0.0.1."""

import json
import logging
import re
import subprocess
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from bridges.kinds.shared.rmf_section import Zenoh, ZenohTls
from bridges.messages import definitions as d
from bridges.messages.releases import NEWEST
from bridges.messages.topics import (
    DOOR_REQUESTS,
    EMERGENCY_SIGNAL,
    LIFT_REQUESTS,
    LIFT_STATES,
    AnyTopic,
)
from bridges.transports.transport import Subscription
from bridges.transports.zenoh.transport import ZenohTransport
from tests.transports.zenoh_programs import Router, free_port
from tests.waiting import wait_until

PAGE = (Path(__file__).parents[2] / "docs/how-to/harden.md").read_text()
DOMAIN = 7


def block(language: str) -> str:
    """Return the page's only code block in this language."""
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.M | re.S)
    return str(found)


@pytest.fixture(scope="module")
def papers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the certificates with the page's commands, for hosts on this machine. Return their
    folder."""
    folder = tmp_path_factory.mktemp("papers")
    commands = re.sub(r"[\w-]+\.hospital\.lan", "localhost", block("sh"))
    subprocess.run(["sh", "-e", "-c", commands], cwd=folder, check=True, capture_output=True)
    return folder / "site-ca"


def flat(config: dict[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Yield (`a__b`, value) for each setting of a nested configuration. `access_control` is not split
    into its settings."""
    for key, value in config.items():
        if isinstance(value, dict) and key != "access_control":
            yield from flat(value, (*path, key))
        else:
            yield "__".join((*path, key)), value


@pytest.fixture
def router(papers: Path) -> Iterator[Router]:
    text = block("json").replace("/etc/zenoh/", f"{papers}/")
    settings = dict(flat(json.loads(text)))
    settings.pop("listen__endpoints")
    started = Router(f"tls/localhost:{free_port()}", **settings)
    started.start()
    yield started
    started.leave()


@pytest.fixture
def nodes(router: Router, papers: Path) -> Iterator[dict[str, ZenohTransport]]:
    """Yield three nodes by name. Each node is a client of the router."""
    opened = {name: node(router, papers, name) for name in ("rmf", "lift", "viewer")}
    yield opened
    for each in opened.values():
        each.close()


def node(router: Router, papers: Path, name: str, own: bool = True) -> ZenohTransport:
    """Open a node. With `own` the node has its own certificate."""
    tls = ZenohTls(
        ca=str(papers / "ca.pem"),
        certificate=str(papers / f"{name}.pem") if own else None,
        private_key=str(papers / f"{name}.key") if own else None,
    )
    settings = Zenoh(connect=(router.endpoint,), mode="client", tls=tls)
    return ZenohTransport(name, DOMAIN, loopback=False, settings=settings, release=NEWEST)


def speaker(message: Any) -> str:
    """Return the name of the node that has sent this message of the next test."""
    match message:
        case d.EmergencySignal(fleet_names=(name, *_)):
            return str(name)
        case d.DoorRequest(requester_id=name):
            return str(name)
    return str(message.session_id)


def test_only_rmf_may_ask_and_only_the_lift_may_answer(
    nodes: dict[str, ZenohTransport],
) -> None:
    heard: set[tuple[str, str, str]] = set()  # (listener's name, speaker's name, topic)

    def listen(listener: str, topic: AnyTopic) -> Subscription:
        def note(message: Any) -> None:
            if speaker(message) != listener:  # a node hears its own messages without the router
                heard.add((listener, speaker(message), topic.name))

        return nodes[listener].subscribe(topic, note)

    topics: dict[AnyTopic, Callable[[str], Any]] = {
        LIFT_REQUESTS: lambda name: d.LiftRequest("Lift1", session_id=name),
        DOOR_REQUESTS: lambda name: d.DoorRequest(requester_id=name, door_name="ward"),
        LIFT_STATES: lambda name: d.LiftState(lift_name="Lift1", session_id=name),
        EMERGENCY_SIGNAL: lambda name: d.EmergencySignal((name,)),
    }
    ears = [listen(name, topic) for name in nodes for topic in topics]
    mouths = [
        (nodes[name].publisher(topic), made(name))
        for name in ("viewer", "lift", "rmf")  # the nodes without permission publish first
        for topic, made in topics.items()
    ]
    requests, answers = ("lift_requests", "door_requests"), ("lift_states", "emergency_signal")
    wanted = {(ear, "rmf", topic) for ear in ("lift", "viewer") for topic in (*requests, *answers)}
    wanted |= {(ear, "lift", topic) for ear in ("rmf", "viewer") for topic in answers}

    def all_speak() -> bool:
        for publisher, message in mouths:
            publisher.publish(message)
        return wanted <= heard

    wait_until(all_speak, "the permitted messages arrive")
    for _ in range(3):
        all_speak()
    assert heard == wanted
    assert len(ears) == len(nodes) * len(topics)


def test_a_viewer_announces_no_publisher_so_it_makes_no_supervisor_passive(
    nodes: dict[str, ZenohTransport],
) -> None:
    requests = nodes["rmf"].subscribe(LIFT_REQUESTS, lambda message: None)
    states = nodes["rmf"].subscribe(LIFT_STATES, lambda message: None)
    shows = nodes["lift"].publisher(LIFT_STATES)
    wait_until(lambda: states.senders() == ["/lift"], "the lift is announced")
    forged = [nodes["viewer"].publisher(topic) for topic in (LIFT_REQUESTS, LIFT_STATES)]
    heard_by = shows.matched()
    ear = nodes["viewer"].subscribe(LIFT_STATES, lambda message: None)
    wait_until(
        lambda: shows.matched() == heard_by + 1, "the viewer, which came later, is announced"
    )
    assert (requests.senders(), states.senders()) == ([], ["/lift"])
    assert len([*forged, ear]) == 3  # all of them were open until now


def test_a_stranger_without_a_certificate_does_not_come_in(
    router: Router, papers: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    stranger = node(router, papers, "stranger", own=False)

    def logged(name: str) -> list[str]:
        return [text for text in caplog.messages if f"not_linked node={name} " in text]

    try:
        wait_until(partial(logged, "stranger"), "the stranger has no link")
        assert not [text for text in caplog.messages if text.startswith("linked node=stranger ")]
    finally:
        stranger.close()


def test_the_keys_of_the_certificates_are_their_owners_alone(papers: Path) -> None:
    keys = sorted(papers.glob("*.key"))
    assert {key.stem for key in keys} == {"ca", "router", "rmf", "lift", "viewer"}
    assert {key.stat().st_mode & 0o777 for key in keys} == {0o600}

"""No fault makes a daemon log the same line for ever. Each fault lasts ten minutes of virtual time, and
robots wait meanwhile.

Lifts, doors, chargers, supervisors and the coordinator run the same code as in the daemons. Two lines
count as equal if only their numbers differ.
"""

import re
from collections import Counter
from collections.abc import Callable

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.system import log
from bridges.transports.transport import TransportError
from tests.depth import depth
from tests.site.daemons import GraphDaemon
from tests.site.network import Place
from tests.workbench.explain.story import Scene

SERVED = ("Lift1", "Lift2", "ward", "gate", "bay1")
MOST = 3
"""How often an equal line may be logged in the last five minutes. That is less than once a minute."""


class Hospital(Scene):
    """All devices and nodes. One robot has sent a request for a lift, and another robot for a door."""

    def __init__(self) -> None:
        super().__init__(*SERVED, diagnoses=False)
        self.coordinate("fleet/red", "fleet/blue")
        self.red, self.blue = self.robot("fleet/red"), self.robot("fleet/blue")
        self.red.asks("Lift1", "L2")
        self.blue.opens("ward")
        self.run(2.0)

    @property
    def nodes(self) -> list[GraphDaemon]:
        """Return the nodes without hardware."""
        return [one for one in self.supervisors.values() if isinstance(one, GraphDaemon)]


Trouble = Callable[[Hospital, pytest.MonkeyPatch], None]


def each(scene: Hospital, seconds: float, do: Callable[[], None]) -> None:
    """Call `do` now, and then again every `seconds` seconds."""

    def again() -> None:
        do()
        scene.timeline.after(seconds, again)

    again()


def hardware_gone(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    for name in SERVED:
        scene.devices[name].far.down = "no answer"


def hardware_that_comes_and_goes(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    def flap() -> None:
        for name in SERVED:
            far = scene.devices[name].far
            far.down = "" if far.down else "no answer"

    each(scene, 2.0, flap)


def adapters_gone(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    scene.red.dies()
    scene.blue.dies()


def two_nodes_for_each_device(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    def speak() -> None:
        scene.says(topics.LIFT_STATES, d.LiftState(lift_name="Lift1"))
        scene.says(topics.DOOR_STATES, d.DoorState(door_name="ward"))
        scene.says(topics.CHARGER_STATES, d.ChargerState(charger_name="bay1"))

    each(scene, 1.0, speak)


def rivals_that_are_silent(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    for node in scene.nodes:
        for topic in node.kind.sole:
            Place(scene.air, "rival", lambda: None).publisher(topic)


def a_disk_that_is_full(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    for node in scene.nodes:
        node._disk.full = True


def a_transport_that_fails(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    def fail(message: object) -> None:
        raise TransportError("not sent: this end has no session")

    for node in scene.nodes:
        for end in node.node._outlet._ends.values():
            patch.setattr(end, "publish", fail)


def a_clock_past_2038(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    patch.setattr("tests.site.daemons.EPOCH", 3e9)


def nonsense_on_every_topic(scene: Hospital, patch: pytest.MonkeyPatch) -> None:
    def speak() -> None:
        scene.says(topics.LIFT_REQUESTS, d.LiftRequest("Lift1", session_id="x", request_type=9))
        scene.says(topics.ADAPTER_LIFT_REQUESTS, d.LiftRequest("Lift1"))
        scene.says(topics.DOOR_REQUESTS, d.DoorRequest(door_name="ward"))
        scene.says(topics.CHARGER_REQUESTS, d.ChargerRequest("bay1"))

    each(scene, 0.5, speak)


TROUBLES: dict[str, Trouble] = {
    trouble.__name__: trouble
    for trouble in (
        hardware_gone,
        hardware_that_comes_and_goes,
        adapters_gone,
        two_nodes_for_each_device,
        rivals_that_are_silent,
        a_disk_that_is_full,
        a_transport_that_fails,
        a_clock_past_2038,
        nonsense_on_every_topic,
    )
}


CHANGES = ("hardware_that_comes_and_goes", "two_nodes_for_each_device")
"""Faults during which facts change all the time. Then the log's filter holds repeated lines back."""


@pytest.mark.parametrize("trouble", TROUBLES)
def test_no_line_is_logged_for_ever(
    trouble: str, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level("INFO")
    scene = Hospital()
    if trouble in CHANGES:
        seldom = log.Seldom(lambda: scene.timeline.now)
        monkeypatch.setattr(caplog.handler, "filters", [seldom])
    TROUBLES[trouble](scene, monkeypatch)
    scene.run(depth(120.0, 300.0))
    caplog.clear()
    scene.run(300.0)
    lines = Counter(re.sub(r"\d+", "#", record.getMessage()) for record in caplog.records)
    assert {line: times for line, times in lines.items() if times > MOST} == {}

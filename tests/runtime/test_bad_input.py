"""Impossible requests to a lift's daemon, sent over each transport. The daemon is a real process."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.messages import stamps
from bridges.messages.definitions import LiftMode, LiftRequest, LiftState
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES
from bridges.runtime.clock import TELL_GAP_S
from hal_fakes.wire import join, wire
from tests.runtime.site import Daemon, daemon, shipped
from tests.transports import peer
from tests.transports.conftest import ROS2
from tests.waiting import wait_until

RIGHT = LiftRequest(
    "Lift1", session_id="fleet/robot", request_type=1, destination_floor="L3", door_state=2
)
WRONG = {
    "empty session_id": replace(RIGHT, session_id=""),
    "unknown request_type": replace(RIGHT, request_type=7),
    "unknown door_state": replace(RIGHT, door_state=1),
    "floor not served": replace(RIGHT, destination_floor="L9"),
}


class Lift:
    """The daemon of a simulated lift, and a node in place of RMF. The node can send any request."""

    def __init__(self, running: Daemon, status: Path, domain: int) -> None:
        self.running = running
        self.domain = domain
        self.states: list[LiftState] = []
        self._status = status
        self.transport = join("rmf", domain)
        self._requests = self.transport.publisher(LIFT_REQUESTS)
        self.transport.subscribe(LIFT_STATES, self.states.append)
        wait_until(self._requests.matched, "the node listens")
        wait_until(lambda: self.states, "the node is heard")

    def send(self, request: LiftRequest) -> None:
        self._requests.publish(request)

    def status(self) -> dict[str, Any]:
        wait_until(self._status.exists, "a status file")
        told: dict[str, Any] = json.loads(self._status.read_text())
        return told

    def refused(self) -> dict[str, int]:
        refused: dict[str, int] = self.status()["devices"]["Lift1"]["refused"]
        return refused


@pytest.fixture(params=[wire(), ROS2])
def lift(domain: int, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Lift]:
    file = shipped("lift_dry_contact.yaml", tmp_path, request.param)
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(file, tmp_path / "run", *options) as running:
        running.wait_for("ready")
        made = Lift(running, tmp_path / "run" / "status.json", domain)
        yield made
        made.transport.close()


def test_every_wrong_request_is_refused_by_name_counted_logged_once_and_moves_nothing(
    lift: Lift,
) -> None:
    for _ in range(3):
        for request in WRONG.values():
            lift.send(request)
    lift.send(replace(RIGHT, lift_name="Lift2"))
    counted = dict.fromkeys(WRONG, 3)
    wait_until(lambda: lift.refused() == counted, "all refusals are counted")
    log = lift.running.log.read_text()
    assert [log.count(f'refused device=Lift1 kind="{kind}"') for kind in WRONG] == [1, 1, 1, 1]
    assert "outputs device=Lift1" not in log
    assert {state.session_id for state in lift.states} == {""}
    wait_until(
        lambda: lift.status()["requests_for_others"] == 1, "the other lift's request is counted"
    )


def test_a_flood_ends_with_the_last_valid_request_and_states_go_on(lift: Lift) -> None:
    for n in range(5000):
        lift.send(replace(RIGHT, session_id=f"fleet/{n % 7}", destination_floor=f"L{n % 12}"))
    wait_until(lambda: any(s.session_id for s in lift.states), "a session was granted")
    holder = next(s.session_id for s in lift.states if s.session_id)
    lift.send(replace(RIGHT, session_id=holder, request_type=0, destination_floor=""))
    wait_until(lambda: lift.states[-1].session_id == "", "the holder's END has ended the session")
    before = len(lift.states)
    wait_until(lambda: len(lift.states) > before + 1, "states go on")
    edges = [
        line for line in lift.running.log.read_text().splitlines() if " outputs device" in line
    ]
    # The time that passed in the daemon limits the number of states and the number of relay changes.
    read_at = [stamps.in_seconds(state.lift_time) for state in lift.states if state.lift_time.sec]
    took_s = read_at[-1] - read_at[0]
    assert len(read_at) <= 2 + (took_s + 1) / TELL_GAP_S
    assert len(edges) <= 4 + 2 * took_s


def test_samples_that_are_not_requests_are_dropped_and_good_ones_are_obeyed(
    lift: Lift,
) -> None:
    with peer.running("hostile", lift.domain, wire()):
        wait_until(lambda: lift.status()["samples_dropped"], "hostile samples are counted")
    lift.send(replace(RIGHT, request_type=0))

    def held() -> bool:  # sends again, because the flood may displace a request
        lift.send(RIGHT)
        return lift.states[-1].session_id == "fleet/robot"

    wait_until(held, "the robot holds the lift")
    wait_until(lambda: lift.states[-1].current_mode == LiftMode.MODE_AGV, "AGV mode is on")

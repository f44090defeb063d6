"""A lift's daemon with a real HTTP gateway. The lift rides, the test kills the daemon, and all outputs
go off."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.settings.load import load
from hal_fakes.http import HttpServer
from hal_fakes.http_lift import FakeHttpLift, build
from hal_fakes.realtime import RealTime
from hal_fakes.wire import join, wire
from tests.drivers.lift.contract import QUICK
from tests.runtime.site import daemon
from tests.waiting import wait_until

EXAMPLE = Path(__file__).parents[2] / "config" / "lift_http.yaml"


class Gateway:
    """A gateway with a lift. The gateway's timers run longer than any test, so only the daemon can
    switch off."""

    def __init__(self, folder: Path, domain: int) -> None:
        text = EXAMPLE.read_text().replace("switches_off_after_s: 10", "switches_off_after_s: 900")
        text = text.replace("stale_after_s: 3", "stale_after_s: 3, floor_travel_min_s: 0.001")
        text = text.replace("    ca_file: /etc/rmf-bridges/gateway.pem\n", "")
        text = text.replace("# push_path: /events ", "push_path: /events  # ")
        text = "\n".join(line for line in text.splitlines() if "login:" not in line)
        file = folder / "lift.yaml"
        file.write_text(text)
        settings = load(file).devices["Lift1"]
        self.world = RealTime({"Lift1": build("Lift1", settings, QUICK)})
        self.plant = self.world.plants["Lift1"]
        self.server = HttpServer([FakeHttpLift(self.plant, settings)], "/api", 1.0, "/events")
        text = text.replace("https://192.168.1.60/api", str(self.server.replace["api_base"]))
        rmf = f"transport: {wire()}\n  domain_id: {domain}\n  network: localhost"
        file.write_text(text.replace("transport: auto", rmf))
        self.file = file

    def on(self) -> set[str]:
        """Return the commands that are on."""
        last = {edge.signal: edge.value for edge in self.plant.edges if edge.what == "relay"}
        return {signal for signal, value in last.items() if value}


@pytest.fixture
def gateway(tmp_path: Path, domain: int) -> Iterator[Gateway]:
    made = Gateway(tmp_path, domain)
    yield made
    made.server.close()
    made.world.close()


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGTERM])
def test_a_lift_that_is_held_open_is_let_go_when_its_daemon_dies(
    gateway: Gateway, domain: int, tmp_path: Path, by: signal.Signals
) -> None:
    rmf = join("rmf", domain)
    requests, states = rmf.publisher(topics.LIFT_REQUESTS), list[d.LiftState]()
    rmf.subscribe(topics.LIFT_STATES, states.append)
    ride = d.LiftRequest(
        lift_name="Lift1",
        session_id="fleet/robot",
        request_type=d.LiftRequestType.REQUEST_AGV_MODE,
        destination_floor="L3",
        door_state=d.LiftRequestDoor.DOOR_OPEN,
    )
    with daemon(gateway.file, tmp_path / "run") as running:
        running.wait_for("ready")
        running.wait_for("push_works")

        def held() -> bool:
            requests.publish(ride)
            return gateway.on() == {"agv_mode_request", "door_open"}

        wait_until(held, "the door is held at L3")
        wait_until(lambda: states[-1].current_floor == "L3", "RMF sees the car at L3")
        running.end(by)
        wait_until(lambda: gateway.on() == set(), "everything is off")
    wait_until(lambda: not [*(tmp_path / "run").glob("claimed-*")], "the record is gone")
    rmf.close()

"""`send` and `watch` as whole commands, on the memory transport and as processes on DDS."""

import argparse
import io
import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import pytest
from msgspec.structs import replace

from bridges.cli import main
from bridges.kinds.charger.refusals import ChargerRefusal
from bridges.kinds.shared.rmf_section import Rmf, overridden
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.topics import Topic
from bridges.settings.load import load
from bridges.transports.choose import open_transport
from bridges.transports.transport import Transport
from hal_fakes.wire import Wire, runs_here
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.transports.zenoh_programs import Router
from tests.waiting import LEASE_S, PATIENCE_S, wait_until
from workbench.commands import send, watch
from workbench.graph.join import Renamed, add_graph_arguments
from workbench.graph.requests import Request
from workbench.graph.requests.charger import ChargeCancel, RobotCharge
from workbench.graph.requests.door import DoorMove
from workbench.graph.requests.lift import LiftEnd, LiftRide

M = TypeVar("M", bound=d.Message)
ME = "fleet/robot"
LIFT = d.LiftState(
    lift_time=d.Time(1), lift_name="Lift1", available_floors=("L1", "L3"), current_floor="L1"
)


class Command(MemoryTransport):
    """The command's node. The node gets the device's state when it subscribes, and after each of its
    requests."""

    def __init__(self, device: "Device") -> None:
        super().__init__(device.network, "command")
        self._device = device

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> Any:
        """Subscribe, and deliver one state at once. A real device would publish within 1 s."""
        subscription = super().subscribe(topic, received, others_only=others_only)
        self._device.tell()
        return subscription


class Device:
    """A lift, door or charger on the memory transport. It obeys each request at once."""

    def __init__(self, states: Topic[Any], requests: Topic[Any], state: Any) -> None:
        self.network = MemoryNetwork()
        self.state = state
        self.requests: list[Any] = []
        node = MemoryTransport(self.network, "device")
        self._publisher = node.publisher(states)
        node.subscribe(requests, self._obey)

    def tell(self) -> None:
        self._publisher.publish(self.state)

    def _obey(self, request: Any) -> None:
        self.requests.append(request)
        self.state = obeyed(self.state, request)
        self.tell()


def obeyed(state: Any, request: Any) -> Any:
    match request:
        case d.LiftRequest(request_type=0):
            return replace(state, session_id="")
        case d.LiftRequest():
            return replace(
                state,
                session_id=request.session_id,
                current_floor=request.destination_floor,
                door_state=2,
            )
        case d.DoorRequest():
            return replace(state, current_mode=request.requested_mode)
        case d.ChargerRequest():
            return replace(state, state=2, request_id=request.request_id)
        case _:
            return replace(state, state=1, request_id="")


HELD = replace(LIFT, session_id=ME)
DOOR = d.DoorState(d.Time(1), "ward", d.DoorMode(0))
CHARGER = d.ChargerState(d.Time(1), 1, "a")
BUSY = replace(CHARGER, state=3, request_id="r1")


@pytest.mark.parametrize(
    ("states", "state", "wanted"),
    [
        (topics.LIFT_STATES, LIFT, LiftRide("Lift1", "L3", ME, direct=True)),
        (topics.LIFT_STATES, HELD, LiftEnd("Lift1", "", direct=True)),
        (topics.DOOR_STATES, DOOR, DoorMove("ward", True, ME, direct=True)),
        (topics.CHARGER_STATES, CHARGER, RobotCharge("a", "fleet", "robot", "r1", 30)),
        (topics.CHARGER_STATES, BUSY, ChargeCancel("a", "r1")),
    ],
)
def test_a_request_reaches_the_device_once_and_its_effect_ends_the_command(
    states: Topic[Any], state: d.Message, wanted: Request
) -> None:
    device, out = Device(states, wanted.topic, state), io.StringIO()
    assert send.send(Command(device), wanted, 10.0, out) == 0
    assert [line.split()[2] for line in out.getvalue().splitlines()] == [
        *("state", "request", "state", "done")
    ]
    assert len(device.requests) == 1


def test_a_refused_request_for_a_charger_ends_with_who_has_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    class Refusing(Device):
        def _obey(self, request: Any) -> None:
            refusal = ChargerRefusal(
                request_id=request.request_id,
                charger="a",
                robot="fleet/robot",
                reason="charger occupied",
                held_by="fleet/other",
                held_request="r1",
            )
            MemoryTransport(self.network, "charger").publisher(topics.CHARGER_REFUSALS).publish(
                refusal.message()
            )

    device = Refusing(topics.CHARGER_STATES, topics.CHARGER_REQUESTS, BUSY)
    wanted = RobotCharge("a", "fleet", "robot", "r2", 30)
    assert send.send(Command(device), wanted, 60.0, io.StringIO()) == 1
    assert capsys.readouterr().err == (
        "rmf-bridge send: a refuses the request: charger occupied: fleet/other has it"
        " (request r1); to cancel that request: rmf-bridge send charger a --cancel r1\n"
    )


def test_a_door_that_records_the_fleets_requests_is_no_supervisor(
    capsys: pytest.CaptureFixture[str],
) -> None:
    device = Device(topics.DOOR_STATES, topics.DOOR_REQUESTS, DOOR)
    recorded: list[Any] = []
    MemoryTransport(device.network, "ward").subscribe(
        topics.ADAPTER_DOOR_REQUESTS, recorded.append, others_only=True
    )
    assert send.send(Command(device), DoorMove("ward", True, ME), 0.5, io.StringIO()) == 1
    assert "no door supervisor runs in this domain" in capsys.readouterr().err
    assert recorded == []


def test_send_and_watch_use_the_topic_names_of_the_sites_yaml() -> None:
    network = MemoryNetwork()
    singular = {"charger_states": "charger_state", "charger_requests": "charger_request"}
    ours = Renamed(MemoryTransport(network, "command"), singular)
    site = MemoryTransport(network, "site")
    asked: list[Any] = []
    site.subscribe(topics.CHARGER_REQUESTS.named("charger_request"), asked.append)
    heard: list[Any] = []
    ours.subscribe(topics.CHARGER_STATES, heard.append)
    site.publisher(topics.CHARGER_STATES.named("charger_state")).publish(CHARGER)
    request = d.ChargerRequest("a", "fleet", "robot", d.Duration(30), "r1")
    ours.publisher(topics.CHARGER_REQUESTS).publish(request)
    assert (heard, asked, ours.lives) == ([CHARGER], [request], True)


def test_a_request_carries_the_time_at_which_it_was_sent() -> None:
    device = Device(topics.DOOR_STATES, topics.DOOR_REQUESTS, DOOR)
    assert (
        send.send(Command(device), DoorMove("ward", True, ME, direct=True), 10, io.StringIO()) == 0
    )
    assert device.requests[0].request_time.sec > 1_700_000_000


def test_what_comes_from_the_network_cannot_move_the_cursor(
    capsys: pytest.CaptureFixture[str],
) -> None:
    floors = ("L1\x1b[2J",)
    device = Device(
        topics.LIFT_STATES, topics.LIFT_REQUESTS, replace(LIFT, available_floors=floors)
    )
    assert (
        send.send(Command(device), LiftRide("Lift1", "L3", ME, direct=True), 10, io.StringIO()) == 1
    )
    assert "\x1b" not in capsys.readouterr().err


class Interrupted(io.StringIO):
    """A stream that raises KeyboardInterrupt when the command prints this text."""

    def __init__(self, at: str) -> None:
        super().__init__()
        self._at = at

    def write(self, text: str) -> int:
        if self._at in text:
            raise KeyboardInterrupt
        return super().write(text)


@pytest.mark.parametrize(
    ("directly", "rest"),
    [(True, "the last request remains in effect"), (False, "no request was sent")],
)
def test_an_interrupted_send_says_whether_it_has_asked(
    capsys: pytest.CaptureFixture[str], directly: bool, rest: str
) -> None:
    device = Device(topics.LIFT_STATES, topics.LIFT_REQUESTS, LIFT)
    ride = LiftRide("Lift1", "L3", ME, direct=directly)
    assert send.send(Command(device), ride, 10.0, Interrupted("held by" if directly else "")) == 130
    assert capsys.readouterr().err == f"rmf-bridge send: interrupted; {rest}\n"
    assert len(device.requests) == directly


def test_the_reason_goes_to_standard_error_and_the_exit_code_is_1(
    capsys: pytest.CaptureFixture[str],
) -> None:
    device, out = Device(topics.LIFT_STATES, topics.LIFT_REQUESTS, LIFT), io.StringIO()
    request = LiftRide("Lift1", "L33", ME, direct=True)
    assert send.send(Command(device), request, 10.0, out) == 1
    assert capsys.readouterr().err == (
        "rmf-bridge send: Lift1 serves L1, L3, not 'L33'; did you mean 'L3'?\n"
    )
    assert device.requests == []


def test_once_prints_the_table_or_says_that_nothing_is_there(
    capsys: pytest.CaptureFixture[str],
) -> None:
    device, out = Device(topics.LIFT_STATES, topics.LIFT_REQUESTS, HELD), io.StringIO()
    assert watch.show_once(watch.listen_on(Command(device)), 0.01, out) == 0
    assert out.getvalue().splitlines()[1].split()[:6] == [
        *("lift", "Lift1", "car", "at", "L1,", "door")
    ]
    told = io.StringIO()
    assert watch.show_once(watch.listen_on(Command(device)), 0.01, told, as_json=True) == 0
    (row,) = json.loads(told.getvalue())
    assert (row["kind"], row["name"], row["held_by"]) == ("lift", "Lift1", HELD.session_id)
    nobody = MemoryTransport(MemoryNetwork(), "alone")
    assert watch.show_once(watch.listen_on(nobody), 0.01, out) == 1
    assert "check the domain and network" in capsys.readouterr().err


# --- command lines -----------------------------------------------------------------------------


def parsed(line: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    send.add_arguments(parser)
    return parser.parse_args(line.split(), argparse.Namespace(typed=("send", *line.split())))


@pytest.mark.parametrize(
    "line",
    [
        "lift Lift1",
        "lift Lift1 L3",
        "lift Lift1 L3 --session x --end",
        "lift Lift1 --end --granted-only",
        "lift Lift1 L3 --session x --timeout -1",
        "door ward",
        "door ward shut",
        "charger a",
        "charger a --robot robot",
        "charger a --robot /robot",
        "charger a --robot fleet/robot --cancel r1",
        "charger a --robot fleet/robot --direct",
        "",
    ],
)
def test_send_and_watch_refuse_a_command_line_that_contradicts_itself(line: str) -> None:
    with pytest.raises(SystemExit) as left:
        send.request_of(parsed(line))
    assert left.value.code == 2


@pytest.mark.parametrize(
    "options",
    [
        "",
        " --localhost",
        " --direct --localhost",
        " --transport auto",
        " --config site.yaml --domain-id 7 --transport zenoh --localhost",
    ],
)
def test_a_proposed_command_names_the_graph_as_the_typed_one_did(options: str) -> None:
    request = send.request_of(parsed(f"lift Lift1 L3 --session me{options}"))
    proposed = request.line.other("send", "lift", "Lift1", "--end")
    assert proposed == f"rmf-bridge send lift Lift1 --end{options}"


def test_a_request_id_is_new_each_time_and_begins_with_our_name() -> None:
    first, second = (send.request_of(parsed("charger a --robot f/r")) for _ in range(2))
    assert isinstance(first, RobotCharge)
    assert isinstance(second, RobotCharge)
    ids = [request.request_id for request in (first, second)]
    assert ids[0] != ids[1]
    assert all(i.startswith("rmf_bridge_send-") for i in ids)


# --- as processes ------------------------------------------------------------------------------


@pytest.fixture(params=sorted({runs_here(), "zenoh"}))
def speaks(request: pytest.FixtureRequest) -> Wire:
    """Return the transport that the daemon and the command use."""
    speaks: Wire = request.param
    return speaks


@contextmanager
def device(speaks: Wire, domain: int) -> Iterator[Transport]:
    node = open_transport(Rmf(transport=speaks, domain_id=domain), "device", localhost=True)
    try:
        yield node
    finally:
        node.close()


@contextmanager
def command(line: str, speaks: Wire, domain: int) -> Iterator[subprocess.Popen[str]]:
    words = [sys.executable, "-m", "bridges.cli", *line.split()]
    words += ["--domain-id", str(domain), "--localhost", "--transport", speaks]
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def test_a_lift_is_sent_for_by_another_process_on_the_adapter_topic(
    speaks: Wire, domain: int
) -> None:
    with device(speaks, domain) as node:
        states = node.publisher(topics.LIFT_STATES)
        requests: list[d.LiftRequest] = []
        node.subscribe(topics.ADAPTER_LIFT_REQUESTS, requests.append)
        node.publisher(topics.LIFT_REQUESTS)  # stands in for the supervisor's publisher
        with command("send lift Lift1 L3 --session fleet/robot", speaks, domain) as process:
            wait_until(lambda: states.matched() > 0, "send listens to lift_states")
            states.publish(LIFT)
            wait_until(lambda: requests, "the request arrives")
            states.publish(obeyed(LIFT, requests[0]))
            out, error = process.communicate(timeout=PATIENCE_S)
        assert (process.returncode, error) == (0, "")
        assert "done" in out
        assert replace(requests[0], request_time=d.Time()) == d.LiftRequest(
            "Lift1", d.Time(), ME, 1, "L3", 2
        )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_watch_prints_changes_and_leaves_the_graph_at_once_when_told_to(
    speaks: Wire,
    domain: int,
    number: signal.Signals,
) -> None:
    with device(speaks, domain) as node, command("watch", speaks, domain) as process:
        states = node.publisher(topics.DOOR_STATES)
        wait_until(lambda: states.matched() > 0, "watch listens to door_states")
        states.publish(DOOR)
        assert process.stdout is not None
        assert process.stdout.readline().split()[1:4] == ["door", "ward", "closed"]
        process.send_signal(number)
        assert process.wait(timeout=PATIENCE_S) == 0
        wait_until(lambda: states.matched() == 0, "watch has left the graph", patience_s=LEASE_S)


def test_an_interrupted_send_exits_130_and_leaves_no_ghost_that_asks_for_the_door(
    speaks: Wire,
    domain: int,
) -> None:
    with (
        device(speaks, domain) as node,
        command("send door ward open --direct", speaks, domain) as process,
    ):
        heard = node.subscribe(topics.DOOR_REQUESTS, lambda _: None)
        wait_until(lambda: heard.matched() > 0, "send listens to door_requests")
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=PATIENCE_S) == 130
        wait_until(lambda: heard.matched() == 0, "send has left the graph", patience_s=LEASE_S)


def test_a_command_reaches_a_site_as_a_device_yaml_does(tmp_path: Path) -> None:
    """With `--config` the command takes the router, domain and keys from the site's file. Other options
    of the command override the file."""
    router = Router()
    file = tmp_path / "lift.yaml"
    shipped = (Path(__file__).parents[3] / "config" / "lift_supervisor.yaml").read_text()
    section = f"rmf: {{transport: zenoh, domain_id: 9, zenoh: {{connect: [{router.endpoint}]}}}}"
    file.write_text(re.sub(r"^rmf:.*\n(?: .*\n)*", section + "\n", shipped, flags=re.MULTILINE))
    router.start()
    node = open_transport(load(file).rmf, "device")
    try:
        states = node.publisher(topics.DOOR_STATES)
        words = [sys.executable, "-m", "bridges.cli", "watch", "--config", str(file)]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
            wait_until(lambda: states.matched() > 0, "watch listens to door_states")
            states.publish(DOOR)
            assert process.stdout is not None
            assert process.stdout.readline().split()[1:4] == ["door", "ward", "closed"]
            process.terminate()
        options = argparse.ArgumentParser()
        add_graph_arguments(options)
        told = options.parse_args(["--config", str(file), "--domain-id", "3"])
        assert overridden(load(file).rmf, told) == replace(load(file).rmf, domain_id=3)
    finally:
        node.close()
        router.leave()


def test_a_file_that_is_not_a_yaml_of_ours_is_refused_at_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad.yaml").write_text("kind: nothing\n")
    assert main(["watch", "--config", str(tmp_path / "bad.yaml")]) == 1
    assert "bad.yaml:1:7: " in capsys.readouterr().err

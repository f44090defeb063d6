"""`rmf-bridge doctor` on real Modbus, HTTP and CAN connections, and on a ROS graph of RMF."""

import io
import json
import os
import shlex
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from bridges import cli
from bridges.messages.definitions import DoorMode, DoorModeValue, DoorState, Time
from bridges.messages.topics import DOOR_REQUESTS, DOOR_STATES
from bridges.runtime import record
from bridges.runtime.holder import HOLDER
from bridges.runtime.record import Records
from bridges.settings.load import load
from bridges.system.directories import Directories
from hal_fakes.__main__ import served as served_by
from hal_fakes.caller import Caller
from hal_fakes.wire import join, wire
from tests.commands import runtime
from tests.commands.terminal import Terminal
from tests.runtime.site import Module, command, daemon, environment
from tests.waiting import PATIENCE_S, wait_until
from workbench.commissioning.doctor.served import NOT_ASKED, served
from workbench.commissioning.examples import CONFIG

READS = {1, 2, 3, 4}
"""Modbus functions that only read."""
LISTEN_S = "15"
"""The time (s) for which the doctor listens. On a busy machine nodes find each other late."""


def doctor(file: Path, tmp_path: Path, *options: str) -> tuple[int, dict[str, list[Any]]]:
    """Return the exit code, and a list of (level, finding) for each subject."""
    words = ["doctor", str(file), "--json", "--runtime-dir", str(tmp_path / "run")]
    with redirect_stdout(io.StringIO()) as told:
        code = cli.main([*words, *options])
    subjects: dict[str, list[Any]] = {}
    for one in json.loads(told.getvalue()):
        subjects.setdefault(one["subject"], []).append((one["level"], one["found"]))
    return code, subjects


class Tapped:
    """A relay for TCP between the doctor and the Modbus module. The relay records each requested Modbus
    function, and counts the connections."""

    def __init__(self, module: Module) -> None:
        self.functions: set[int] = set()
        self.clients = 0
        self._far = load(module.file).buses["module"].tcp
        self._listening = socket.create_server(("127.0.0.1", 0))
        port = self._listening.getsockname()[1]
        self.file = module.directory / "tapped.yaml"
        self.file.write_text(module.yaml.replace(f"port: {self._far.port}", f"port: {port}"))
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listening.accept()
            except OSError:
                return
            self.clients += 1
            far = socket.create_connection((self._far.host, self._far.port))
            for one, other, asks in ((near, far, True), (far, near, False)):
                thread = threading.Thread(target=self._carry, args=(one, other, asks))
                self._threads.append(thread)
                thread.start()

    def _carry(self, one: socket.socket, other: socket.socket, asks: bool) -> None:
        with one:
            try:
                while octets := one.recv(4096):
                    if asks:
                        self.functions.add(octets[7])
                    other.sendall(octets)
                other.shutdown(socket.SHUT_RDWR)
            except OSError:
                return

    def close(self) -> None:
        self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        for thread in self._threads:
            thread.join()


@pytest.fixture
def tapped(module: Module) -> Iterator[Tapped]:
    tap = Tapped(module)
    yield tap
    tap.close()


def test_a_module_is_read_and_its_units_are_found_and_nothing_is_written(
    tapped: Tapped, module: Module, tmp_path: Path
) -> None:
    code, found = doctor(tapped.file, tmp_path, "--listen", "0")
    reading, scan = found["bus module"]
    assert reading == ("ok", "ward_door answers: closed yes")
    assert scan[1].startswith("of the units 1 to 16 these answer: 1 (")
    assert found["daemon"] == [("ok", "no daemon serves this file, so its buses are read here")]
    assert tapped.functions <= READS
    assert module.relay() == []
    assert code in (0, 1)  # the machine that runs this test may lack a watchdog


def test_a_device_that_does_not_answer_is_wrong(module: Module, tmp_path: Path) -> None:
    module.file.write_text(module.yaml.replace("unit 1", "unit 9"))
    code, found = doctor(module.file, tmp_path, "--listen", "0")
    (level, text), (scanned, units) = found["bus module"]
    assert (code, level, scanned) == (2, "wrong", "warning")
    assert text.startswith("ward_door: modbus unit 9 at 127.0.0.1:")
    assert "these answer: 1 (" in units


def test_the_bus_of_a_running_daemon_is_not_opened(
    tapped: Tapped, module: Module, tmp_path: Path
) -> None:
    with daemon(tapped.file, tmp_path / "run") as running:
        running.wait_for("ready file")
        wait_until((tmp_path / "run" / "status.json").exists, "the status is written")
        _, found = doctor(tapped.file, tmp_path, "--listen", "0", "--kill-test", "--yes")
        assert tapped.clients == 1
        assert module.relay() == []
        told = found["daemon"]
        assert [level for level, _ in told] == ["ok", "warning", "ok"]
        assert told[0][1].endswith(
            "doctor does not read the buses, because only one process may use a bus"
        )
        assert told[1][1] == "door_states: nobody listens"
        assert told[2][1].startswith("ward_door was read ")
        assert "bus module" not in found
        assert found["kill test"] == [("wrong", f"process {running.process.pid} serves this file")]


def test_where_a_daemon_cannot_be_seen_no_bus_is_opened(
    tapped: Tapped, module: Module, tmp_path: Path
) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / HOLDER).symlink_to(tmp_path / "elsewhere")
    code, found = doctor(tapped.file, tmp_path, "--listen", "0", "--kill-test", "--yes")
    assert (code, [level for level, _ in found["daemon"]]) == (2, ["wrong"])
    assert [level for level, _ in found["kill test"]] == ["wrong"]
    assert (tapped.clients, "bus module" in found, module.relay()) == (0, False, [])


def test_after_a_death_the_outputs_come_first(
    tapped: Tapped, module: Module, tmp_path: Path
) -> None:
    places = Directories(tmp_path / "run", tmp_path / "run")
    Records(places).write(record.of(load(tapped.file)))
    code, found = doctor(tapped.file, tmp_path, "--listen", "0")
    assert (code, found["daemon"]) == (
        2,
        [("wrong", f"the daemon has died, and may have left outputs on; {NOT_ASKED}")],
    )
    assert tapped.clients == 0


def test_the_kill_test_shows_that_the_guard_switches_off(module: Module, tmp_path: Path) -> None:
    _, found = doctor(module.file, tmp_path, "--listen", "0", "--kill-test", "--yes")
    ((level, text),) = found["kill test"]
    assert level == "ok"
    assert text.startswith(
        "ward_door hold_open was on, the process that held it was killed with -9, and the guard"
    )
    assert module.relay() == [True, False]


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT, signal.SIGHUP])
def test_a_doctor_that_dies_in_its_kill_test_leaves_nothing_on(
    module: Module, tmp_path: Path, number: int
) -> None:
    words: list[str | Path] = ["doctor", module.file, "--runtime-dir", tmp_path / "run"]
    words += ["--listen", "0", "--kill-test", "--yes"]
    with subprocess.Popen(command(*words), env=environment(), stdout=subprocess.DEVNULL) as ended:
        wait_until(lambda: module.relay() == [True], "the relay is on")
        ended.send_signal(number)
        wait_until(lambda: module.relay() == [True, False], "the relay is off")
        assert ended.wait(PATIENCE_S) in (-number, 130)
    places = Directories(tmp_path / "run", tmp_path / "run")
    wait_until(lambda: not Records(places).unreleased(), "the outputs are verified off")


def test_the_kill_test_switches_nothing_on_a_dead_bus(module: Module, tmp_path: Path) -> None:
    module.tell("fail", "ward_door", "server", "off")
    _, found = doctor(module.file, tmp_path, "--listen", "0", "--kill-test", "--yes")
    ((level, text),) = found["kill test"]
    assert level == "wrong"
    assert text.startswith("ward_door hold_open was not switched on: no Modbus TCP connection")
    module.tell("fail", "ward_door", "server", "ok")
    places = Directories(tmp_path / "run", tmp_path / "run")
    wait_until(
        lambda: not Records(places).unreleased(),
        "the guard has verified the outputs off",
    )


FIRE = """
kind: door
driver: dry_contact
buses:
  module: {{type: modbus, tcp: {{host: 127.0.0.1, port: {port}}}}}
doors:
  ward_door:
    on_fire: release
    inputs:
      opened: {{point: "unit 1 discrete input 0", active: high}}
      closed: {{point: "unit 1 discrete input 1", active: high}}
      fire: {{point: "unit 1 discrete input 2", active: low}}
    outputs:
      hold_open: {{point: "unit 1 coil 0", active: high}}
"""


def test_the_kill_test_switches_nothing_on_against_a_fire_alarm(tmp_path: Path) -> None:
    with far_side(FIRE.format(port=502), "module", tmp_path) as there:
        with Caller(tmp_path / "plant.sock") as control:
            control.order("press ward_door fire on")
        file = tmp_path / "door.yaml"
        file.write_text(FIRE.format(port=there["tcp"]["port"]))
        _, found = doctor(file, tmp_path, "--listen", "0", "--kill-test", "--yes")
    text = "ward_door hold_open was not switched on: the fire alarm is on"
    assert found["kill test"] == [("wrong", text)]


def test_the_kill_test_asks_before_it_switches(module: Module, tmp_path: Path) -> None:
    words = ("doctor", module.file, "--listen", "0", "--runtime-dir", tmp_path / "run")
    terminal = Terminal(*words, "--kill-test", environ=environment())
    terminal.wait_for("hold_open of ward_door will be ON for some seconds")
    terminal.type("no\n")
    terminal.wait_for("nothing was switched")
    assert terminal.end() == os.EX_USAGE
    assert module.relay() == []


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ((), "Write --yes if nobody can come to harm"),
        (("--device", "other"), "the file has no device 'other'; it has ward_door"),
        (("--output", "other"), "ward_door has no such output"),
    ],
)
def test_without_a_terminal_or_an_output_there_is_no_kill_test(
    module: Module, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: Any, why: str
) -> None:
    assert cli.main(["doctor", str(module.file), "--kill-test", *options]) == os.EX_USAGE
    assert why in capsys.readouterr().err
    assert module.relay() == []


@pytest.mark.parametrize(
    ("file", "why"),
    [
        ("robots_http.yaml", "a fleet has no outputs to test by hand\n"),
        ("robots_vda5050.yaml", "a fleet has no outputs to test by hand\n"),
        ("lift_supervisor.yaml", "a lift_supervisor has no outputs to test by hand\n"),
        ("door_supervisor.yaml", "a door_supervisor has no outputs to test by hand\n"),
        ("charger_coordinator.yaml", "a charger_coordinator has no outputs to test by hand\n"),
        ("alarm_panel.yaml", "Main panel has no outputs to test by hand\n"),
        ("charger_register.yaml", "charger_f has no outputs to test by hand\n"),
    ],
)
def test_without_outputs_there_is_no_kill_test(
    file: str, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["doctor", str(CONFIG / file), "--kill-test", "--yes", "--listen", "0"]
    assert cli.main(words) == os.EX_USAGE
    assert capsys.readouterr().err == why


def test_a_bad_yaml_is_reported_as_check_reports_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad.yaml").write_text("kind: lift\n")
    assert cli.main(["doctor", str(tmp_path / "bad.yaml")]) == os.EX_CONFIG
    assert "bad.yaml:1:1:" in capsys.readouterr().err


def test_for_people_each_finding_has_a_line_below_its_subject(
    module: Module, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["doctor", str(module.file), "--listen", "0", "--runtime-dir", str(tmp_path / "run")]
    cli.main(words)
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["file", f"  ok       {module.file} is a valid file of a door"]
    assert "  ok       ward_door answers: closed yes" in lines
    assert "\x1b" not in "".join(lines)


@contextmanager
def far_side(yaml: str, bus: str, folder: Path) -> Iterator[Any]:
    """Simulate the devices on a bus. Yield the settings with which the doctor reaches these devices."""
    (folder / "far.yaml").write_text(yaml)
    with served_by(folder / "far.yaml", bus, folder / "plant.sock") as there:
        yield there


HTTP = """
kind: charger
driver: http
buses:
  tpu: {{type: http, api_base: "{base}", timeout_s: 5}}
chargers:
  charger_a:
    codes: {{idle: [0], handshake: [1], charging: [5], stopping: [6], released: [7], error: [8]}}
"""


def test_an_http_station_answers_and_is_decoded(tmp_path: Path) -> None:
    with far_side(HTTP.format(base="127.0.0.1/api"), "tpu", tmp_path) as there:
        file = tmp_path / "charger.yaml"
        file.write_text(HTTP.format(base=there["api_base"]))
        _, found = doctor(file, tmp_path, "--listen", "0")
        ((level, text),) = found["bus tpu"]
        assert (level, text.startswith("charger_a answers: activity idle")) == ("ok", True)
    code, found = doctor(file, tmp_path, "--listen", "0")
    ((level, text),) = found["bus tpu"]
    assert (code, level) == (2, "wrong")
    assert "refuses the connection" in text


CAN = """
kind: charger
driver: canopen
buses:
  can: {{type: can, slcan: {{port: {port}, bitrate: 250000}}, timeout_s: 0.2}}
chargers:
  charger_b: {{node: {node}, heartbeat_timeout_s: 2, on_death: keep}}
"""


def test_a_canopen_receiver_answers_and_is_found_by_its_node(tmp_path: Path) -> None:
    with far_side(CAN.format(port="/dev/null", node=10), "can", tmp_path) as there:
        file = tmp_path / "charger.yaml"
        port = there["slcan"]["port"]
        file.write_text(CAN.format(port=port, node=10))
        _, found = doctor(file, tmp_path, "--listen", "0")
        assert [level for level, _ in found["bus can"]] == ["ok", "ok"]
        assert "of the nodes 1 to 16 these answer: 10 (" in found["bus can"][1][1]
        file.write_text(CAN.format(port=port, node=4))
        code, found = doctor(file, tmp_path, "--listen", "0")
        (heard, silent, scanned) = sorted(found["bus can"])
        assert code == 2
        assert heard[1].startswith("there are frames that no device of this file sends: 0x70A")
        assert "these answer: 10 (" in silent[1]
        assert "no heartbeat within 2 s, but heartbeats of node 10" in scanned[1]


@pytest.mark.long(15)
def test_senders_on_the_graph_are_listed_and_a_second_door_of_the_name_is_wrong(
    module: Module, tmp_path: Path
) -> None:
    rmf = join("rmf", module.domain)
    rmf.publisher(DOOR_REQUESTS)
    states = rmf.publisher(DOOR_STATES)
    ended = threading.Event()

    def tell() -> None:
        while not ended.wait(0.1):
            mode = DoorMode(int(DoorModeValue.MODE_CLOSED))
            states.publish(DoorState(Time(1, 0), "ward_door", mode))

    telling = threading.Thread(target=tell)
    telling.start()
    try:
        _, found = doctor(module.file, tmp_path, "--listen", LISTEN_S)
    finally:
        ended.set()
        telling.join()
        rmf.close()
    assert ("ok", "door_requests: from 1 node") in found["RMF"]
    assert ("wrong", "somebody already publishes ward_door") in found["RMF"]
    assert found["network"] == [("note", f"domain {module.domain}, on this machine alone")]
    assert [level for level, _ in found["messages"]] == ["ok"]


@pytest.mark.long(15)
def test_our_daemon_is_heard_and_a_graph_without_rmf_is_warned_of(
    module: Module, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        running.wait_for("ready file")
        wait_until((tmp_path / "run" / "status.json").exists, "the status is written")
        _, found = doctor(module.file, tmp_path, "--listen", LISTEN_S)
    assert ("ok", "ward_door is heard") in found["RMF"]
    assert ("warning", "door_requests: nobody sends") in found["RMF"]


@pytest.mark.long(15)
def test_a_supervisor_beside_another_one_would_be_passive(domain: int, tmp_path: Path) -> None:
    file = tmp_path / "supervisor.yaml"
    file.write_text(
        "kind: door_supervisor\nsupervisor: {}\n"
        f"rmf: {{transport: {wire()}, network: localhost, domain_id: {domain}}}\n"
    )
    rmf = join("rmf", domain)
    rmf.publisher(DOOR_REQUESTS)
    try:
        code, found = doctor(file, tmp_path, "--listen", LISTEN_S)
    finally:
        rmf.close()
    assert code == 1
    assert ("warning", "1 other node(s) have the same task") in found["RMF"]


def test_a_name_that_is_not_on_the_map_is_wrong(module: Module, tmp_path: Path) -> None:
    (tmp_path / "site.building.yaml").write_text("name: site\nlevels: {}\nlifts: {}\n")
    options = ("--listen", "0", "--building-map", str(tmp_path / "site.building.yaml"))
    code, found = doctor(module.file, tmp_path, *options)
    assert code == 2
    ((level, text),) = [one for one in found["file"] if one[0] not in ("ok", "note")]
    assert (level, "ward_door" in text) == ("wrong", True)


def test_a_simulation_is_named_and_looked_for_on_loopback(tmp_path: Path) -> None:
    told = {"simulated": True, "version": "1", "heard_by": {"lift_states": 0}, "devices": {}}
    with runtime.served(tmp_path / "lift_a", told) as folder:
        found = served(Directories(folder, folder), tmp_path / "lift_a.yaml", time.time())
    assert found.simulated
    assert [(one.level, one.found) for one in found.findings][1:] == [
        ("note", "the daemon is a SIMULATION")
    ]


def test_how_to_look_at_the_graph_names_the_graph_that_was_asked_for(
    module: Module, tmp_path: Path, capsys: pytest.CaptureFixture[str], domain: int
) -> None:
    options = ["--domain-id", str(domain), "--transport", wire(), "--localhost"]
    words = ["doctor", str(module.file), "--listen", "0.1", "--json"]
    cli.main([*words, "--runtime-dir", str(tmp_path / "run"), *options])
    told = [one["do"] for one in json.loads(capsys.readouterr().out)]
    watch = shlex.join(["rmf-bridge", "watch", "--config", str(module.file), *options])
    assert [watch in do for do in told if "rmf-bridge watch" in do] == [True]

"""Compare a door behind an MQTT broker with the same door on Modbus TCP: time of a command, and memory.

The two daemons run side by side and get their requests in turn. The time begins when the request is
published. It ends when the simulated door's relay switches. On MQTT, the message passes through the
broker mosquitto.
"""

import subprocess
import time
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

from bench.daemons import Content, daemon, graph, memory_mb, ready, shipped
from bench.figures import Row, Rows, Tables, compared
from bench.idle import doors
from bridges.messages.definitions import DoorMode, DoorModeValue, DoorRequest
from bridges.messages.topics import DOOR_REQUESTS
from bridges.transports.transport import Publisher
from hal_fakes.caller import Caller

ROUNDS = 200
WARM_UP = 20
PAUSE_S = 0.12
LIMITS = {"limits": {"close_grace_s": 0, "stale_after_s": 30}}


def measure(scratch: Path) -> Tables:
    """Return the tables, with a row for each bus."""
    on_modbus = doors(1)
    on_modbus["doors"] = {"modbus": {**on_modbus["doors"]["door_1"], **LIMITS}}
    on_mqtt = shipped("door_mqtt")
    on_mqtt["doors"] = {"mqtt": {**on_mqtt["doors"]["pharmacy_door"], **LIMITS}}
    found: dict[str, list[float]] = {"modbus": [], "mqtt": []}
    pids: dict[str, int] = {}
    with ExitStack() as open_ends:
        requests = open_ends.enter_context(graph()).publisher(DOOR_REQUESTS)
        plants = {}
        for name, content in (("modbus", on_modbus), ("mqtt", on_mqtt)):
            child = open_ends.enter_context(_door(scratch, name, content))
            plants[name] = open_ends.enter_context(Caller(scratch / name / "plant.sock"))
            plants[name].order("follow")
            pids[name] = child.pid
        time.sleep(1.0)  # DDS may not have matched the daemon's reader yet
        for _ in range(WARM_UP + ROUNDS):
            for name, plant in plants.items():
                found[name].append(_held(requests, name, plant))
        memory: dict[str, Row] = {n: {"RSS MB": memory_mb(pid)} for n, pid in pids.items()}
    rows: Rows = {n: compared(s[WARM_UP:], found["modbus"][WARM_UP:]) for n, s in found.items()}
    return {"DoorRequest to relay": {name: {**row, **memory[name]} for name, row in rows.items()}}


def _door(
    scratch: Path, name: str, content: Content
) -> AbstractContextManager["subprocess.Popen[bytes]"]:
    return ready(daemon(content, scratch / name), scratch / f"{name}.log")


def _held(requests: Publisher[DoorRequest], name: str, plant: Caller) -> float:
    """Publish an OPEN and return the time (s) until the relay `hold_open` switches on. Then release the
    door."""
    sent_at = time.monotonic()
    _request(requests, name, DoorModeValue.MODE_OPEN)
    took = plant.edge("hold_open", True) - sent_at
    _request(requests, name, DoorModeValue.MODE_CLOSED)
    plant.edge("hold_open", False)
    time.sleep(PAUSE_S)
    return took


def _request(requests: Publisher[DoorRequest], name: str, mode: DoorModeValue) -> None:
    asked = DoorMode(int(mode))
    requests.publish(DoorRequest(door_name=name, requester_id="bench", requested_mode=asked))

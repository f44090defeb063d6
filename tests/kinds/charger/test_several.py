"""Several stations in one daemon. A fault of one station does not disturb the other stations."""

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from bridges.messages.definitions import ChargerState, ChargerStateValue
from bridges.messages.topics import CHARGER_STATES
from bridges.runtime.service import service
from bridges.runtime.serving import stop
from bridges.settings.load import load
from tests.drivers.hal.http.far_end import Caller, Conversation, FarEnd, always, answer
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.waiting import wait_until

TIMEOUT_S = 0.5
"""The timeout (s) of the faulty station. The other stations have a longer timeout, because the test's
machine may be busy."""


def silent(caller: Caller) -> None:
    caller.request()
    caller.hold()


def trickles(caller: Caller) -> None:
    caller.request()
    caller.for_ever(b"H", 0.1)


@contextmanager
def daemon(file: Path, **stations: Conversation) -> Iterator[list[ChargerState]]:
    """Serve these stations. Yield a list that gets each ChargerState of the daemon.

    Each station has its own bus. Station `b` is the faulty station.
    """
    buses, chargers = {}, {}
    with ExitStack() as open_:
        for name, talk in stations.items():
            far = open_.enter_context(FarEnd(talk))
            base = f"127.0.0.1:{far.port}"
            timing = {"timeout_s": TIMEOUT_S if name == "b" else 5.0, "scan_s": 0.05}
            buses[name] = {"type": "http", "api_base": base, **timing}
            chargers[name] = {"bus": name, "codes": {"idle": [0], "charging": [5], "error": [8]}}
        whole = {"kind": "charger", "driver": "http", "buses": buses, "chargers": chargers}
        file.write_text(json.dumps(whole))
        network = MemoryNetwork()
        states: list[ChargerState] = []
        MemoryTransport(network, "rmf").subscribe(CHARGER_STATES, states.append)
        config = load(file)
        served = service(config, MemoryTransport(network, "chargers"), config.open_bus)
        served.subscribe()
        for loop in served.loops:
            loop.start()
        yield states
        assert stop(served.loops, 10.0)


def told(states: list[ChargerState], name: str) -> list[tuple[int, str]]:
    return [(s.state, s.error_message) for s in states if s.charger_name == name]


@pytest.mark.parametrize("bad", [silent, trickles], ids=["silent", "trickling"])
def test_a_dead_station_is_shown_as_dead_and_other_stations_are_read_on_time(
    tmp_path: Path, bad: Callable[[Caller], None]
) -> None:
    sound = always(answer(b'{"state": 5}'))
    with daemon(tmp_path / "three.yaml", a=sound, b=bad, c=sound) as states:
        wait_until(lambda: len(told(states, "b")) > 2, "states of the dead one")
        wait_until(lambda: min(len(told(states, n)) for n in "ac") > 2, "states of the others")
    charging = (int(ChargerStateValue.CHARGER_CHARGING), "")
    error = (int(ChargerStateValue.CHARGER_ERROR), "Charger unreachable")
    assert set(told(states, "a")) == set(told(states, "c")) == {charging}
    assert set(told(states, "b")) == {error}

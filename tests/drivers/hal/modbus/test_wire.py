"""The connection to a module: its failures, its memory use, and its settings in a YAML file."""

import errno
import re
import socket
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.settings.load import load
from drivers.hal.modbus import ModbusSettings, Serial, Tcp, warnings
from drivers.hal.modbus.tcp import Connection
from drivers.hal.modbus.wire import NoReply, UnitRequest, Unreachable
from tests.drivers.hal.modbus.module import Module, door


def unreachable(failure: OSError) -> str:
    def resolve(*asked: object, **more: object) -> list[Any]:
        raise failure

    with pytest.raises(Unreachable) as caught:
        Connection("gateway", 502, 0.3, resolve).connect()
    return str(caught.value)


@pytest.mark.parametrize(
    ("failure", "text"),
    [
        (socket.gaierror(-2, "unknown"), "the host's name is not known; write its address"),
        (TimeoutError(), "nobody answers within 0.3 s; check power and cable"),
        (OSError(errno.ENETUNREACH, "Network is unreachable"), "Network is unreachable"),
        (
            ConnectionRefusedError(),
            "refused; is the address right, and has the module a free",
        ),
        (OSError("odd"), "odd"),
    ],
)
def test_a_connection_that_cannot_be_made_says_what_to_look_at(failure: OSError, text: str) -> None:
    assert unreachable(failure).startswith(f"no Modbus TCP connection to gateway:502: {text}")


def test_a_reset_connection_does_not_count_as_a_reply() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        connection = Connection("127.0.0.1", listener.getsockname()[1], 5.0)
        connection.connect()
        far_end, _ = listener.accept()
        far_end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        far_end.close()
        with pytest.raises(NoReply, match="the connection broke"):
            connection.ask(UnitRequest(1, 1, 0, 1))
        connection.close()


@pytest.mark.parametrize(
    ("host", "problems"),
    [
        ("192.168.1.50", []),
        ("module.ward-3", []),
        ("fe80::1", []),
        (
            "192.168.1.50:502",
            ["'192.168.1.50:502' contains a port: write host: 192.168.1.50, port: 502"],
        ),
        ("tcp://a", ["'tcp://a' is not a host: write its address, such as 192.168.1.50"]),
        ("a b", ["'a b' is not a host: write its address, such as 192.168.1.50"]),
    ],
)
def test_a_host_is_an_address_or_a_name(host: str, problems: list[str]) -> None:
    assert [text for _, text in Tcp(host=host).problems()] == problems


LINE = {"port": "/dev/serial/by-id/a", "baudrate": 19200, "parity": "none", "stopbits": 1}


@pytest.mark.parametrize(
    ("places", "problems"),
    [
        ({"tcp": {"host": "a"}}, []),
        ({"serial": LINE}, []),
        ({}, ["needs a connection: write tcp: {host: …} or serial: {port: …}"]),
        (
            {"tcp": {"host": "a"}, "serial": LINE},
            ["a bus has only one of tcp and serial: define a second bus"],
        ),
    ],
)
def test_a_bus_is_at_one_place(places: dict[str, Any], problems: list[str]) -> None:
    settings = msgspec.convert({"type": "modbus", **places}, ModbusSettings)
    assert [text for _, text in settings.problems()] == problems


def test_a_serial_line_says_all_of_its_settings() -> None:
    for key in LINE:
        with pytest.raises(msgspec.ValidationError, match=key):
            msgspec.convert({k: v for k, v in LINE.items() if k != key}, Serial)


def test_a_port_is_a_path_and_preferably_a_stable_one() -> None:
    def found(port: str) -> tuple[list[Any], list[Any]]:
        line = msgspec.convert({**LINE, "port": port}, Serial)
        settings = ModbusSettings(serial=line)
        return list(line.problems()), list(warnings(settings))

    text = (
        "'COM3' is not a serial port: write the whole path, as `ls /dev/serial/by-id/*` prints it"
    )
    assert found("COM3") == ([(("port",), text)], [])
    assert found("/dev/serial/by-id/x") == ([], [])
    assert found("/dev/ttyAMA0") == ([], [])
    text = "may be another adapter after the next start: write its /dev/serial/by-id path"
    assert found("/dev/ttyUSB0") == ([], [(("serial", "port"), f"/dev/ttyUSB0 {text}")])


@pytest.mark.parametrize(
    ("baudrate", "parity", "stopbits", "bits", "gap_s"),
    [
        (9600, "none", 1, 10, 35 / 9600),
        (9600, "even", 1, 11, 38.5 / 9600),
        (19200, "none", 2, 11, 38.5 / 19200),
        (38400, "odd", 2, 12, 0.00175),
        (115200, "none", 1, 10, 0.00175),
    ],
)
def test_frames_are_three_and_a_half_characters_apart_and_never_nearer_than_1750_us_when_fast(
    baudrate: int, parity: Any, stopbits: Any, bits: int, gap_s: float
) -> None:
    line = Serial(port="/dev/a", baudrate=baudrate, parity=parity, stopbits=stopbits)
    assert (line.character_s * baudrate, line.gap_s) == pytest.approx((bits, gap_s))


def test_check_warns_of_a_port_that_may_become_another(tmp_path: Path) -> None:
    shipped = Path(__file__).parents[4] / "config" / "door_rs485.yaml"
    file = tmp_path / "door.yaml"
    file.write_text(re.sub(r"/dev/serial/by-id/\S+", "/dev/ttyUSB0", shipped.read_text()))
    (kept,) = (w.text for w in load(shipped).warnings)
    assert kept.startswith("warning: bus 'line': units 1, 2 keep their outputs")
    assert [str(w) for w in load(file).warnings if w.text != kept] == [
        f"{file}:14:13: warning: bus 'line': /dev/ttyUSB0 may be another adapter after the next"
        " start: write its /dev/serial/by-id path"
    ]


def test_the_defaults_bound_what_a_dead_module_can_cost() -> None:
    plain = {"type": "modbus", "tcp": {"host": "192.168.1.50"}}
    assert msgspec.convert(plain, ModbusSettings) == ModbusSettings(
        tcp=Tcp(host="192.168.1.50", port=502), timeout_s=0.3, retries=1, scan_s=0.1
    )


def loaded(code: str) -> set[str]:
    """Run this code in a new interpreter. Return the vendors' Python modules that it has loaded."""
    show = "import sys; print(*[m for m in sys.modules if m.split('.')[0] in WATCHED])"
    watched = "WATCHED = {'pymodbus', 'aiohttp', 'gpiozero', 'requests', 'serial'}"
    done = subprocess.run(
        [sys.executable, "-c", f"{watched}; {code}; {show}"], capture_output=True, check=True
    )
    return set(done.stdout.decode().split())


def test_the_first_request_loads_nothing_more_of_the_vendors_library(either: Module) -> None:
    """Importing a Python module in the first request would take longer than the timeout of one try."""
    door(either)
    made = (
        "from tests.drivers.hal.modbus.module import bus_to;"
        f"bus = bus_to({either.port!r}, retries=0)"
    )
    before = loaded(made)
    assert "pymodbus.framer" in before
    assert loaded(f"{made}; bus.lines({{'unit 1 coil 0': None}}, {{}}).read()") == before
    assert either.functions() == [1]


def test_the_vendors_libraries_are_loaded_with_the_first_bus_and_their_server_never() -> None:
    before = "import drivers.hal.modbus as m, drivers.door.dry_contact, drivers.door.register"
    assert loaded(before) == set()
    tcp = loaded(f"{before}; m.ModbusBus(m.ModbusSettings(tcp=m.Tcp(host='a')))")
    line = "m.Serial(port='/dev/a', baudrate=9600, parity='none', stopbits=1)"
    rtu = loaded(f"{before}; m.ModbusBus(m.ModbusSettings(serial={line}))")
    assert "pymodbus.framer.socket" in tcp
    assert {m for m in tcp if m.startswith(("pymodbus.server", "aiohttp", "serial"))} == set()
    assert {m for m in rtu if m.startswith(("pymodbus.server", "aiohttp"))} == set()
    assert "serial" in rtu

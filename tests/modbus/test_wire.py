"""The connection: why there is none, what it costs in memory, and what a YAML may say of it."""

import errno
import socket
import struct
import subprocess
import sys
from typing import Any

import msgspec
import pytest

from drivers.hal.modbus import Settings, Tcp
from drivers.hal.modbus_wire import Connection, NoReply, Unreachable


def unreachable(failure: OSError) -> str:
    def resolve(*asked: object, **more: object) -> list[Any]:
        raise failure

    with pytest.raises(Unreachable) as caught:
        Connection("gateway", 502, 0.3, resolve).connect()
    return str(caught.value)


@pytest.mark.parametrize(
    ("failure", "text"),
    [
        (socket.gaierror(-2, "unknown"), "its name is not known; write its address"),
        (TimeoutError(), "nobody answers within 0.3 s; check power and cable"),
        (OSError(errno.ENETUNREACH, "Network is unreachable"), "Network is unreachable"),
        (ConnectionRefusedError(), "it is refused; is this the module, and does it take more"),
        (OSError("odd"), "odd"),
    ],
)
def test_a_connection_that_cannot_be_made_says_what_to_look_at(failure: OSError, text: str) -> None:
    assert unreachable(failure).startswith(f"no Modbus TCP connection to gateway:502: {text}")


def test_a_connection_that_is_reset_is_no_reply() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        connection = Connection("127.0.0.1", listener.getsockname()[1], 5.0)
        connection.connect()
        far_end, _ = listener.accept()

        def ask_and_lose(client: Any) -> Any:
            far_end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            far_end.close()
            return client.read_coils(0, count=1, device_id=1)

        with pytest.raises(NoReply, match="the connection broke"):
            connection.ask(1, ask_and_lose)
        connection.close()


@pytest.mark.parametrize(
    ("host", "problems"),
    [
        ("192.168.1.50", []),
        ("module.ward-3", []),
        ("fe80::1", []),
        ("192.168.1.50:502", ["write the host alone; its port goes into port"]),
        ("tcp://a", ["'tcp://a' is no host: write its address, 192.168.1.50 say"]),
        ("a b", ["'a b' is no host: write its address, 192.168.1.50 say"]),
    ],
)
def test_a_host_is_an_address_or_a_name(host: str, problems: list[str]) -> None:
    assert [text for _, text in Tcp(host=host).problems()] == problems


def test_the_defaults_bound_what_a_dead_module_can_cost() -> None:
    plain = {"type": "modbus", "tcp": {"host": "192.168.1.50"}}
    assert msgspec.convert(plain, Settings) == Settings(
        tcp=Tcp(host="192.168.1.50", port=502), timeout_s=0.3, retries=1, scan_s=0.1
    )


def loaded(code: str) -> set[str]:
    """The vendor's modules that a fresh interpreter has after running this."""
    show = "import sys; print(*[m for m in sys.modules if m.split('.')[0] in WATCHED])"
    watched = "WATCHED = {'pymodbus', 'aiohttp', 'gpiozero', 'requests', 'serial'}"
    done = subprocess.run(
        [sys.executable, "-c", f"{watched}; {code}; {show}"], capture_output=True, check=True
    )
    return set(done.stdout.decode().split())


def test_the_vendors_library_is_loaded_with_the_first_connection_and_its_server_never() -> None:
    before = "import drivers.hal.modbus, drivers.door_dry_contact"
    assert loaded(before) == set()
    after = loaded(f"{before}; from drivers.hal.modbus_wire import _client_class; _client_class()")
    assert "pymodbus.client" in after
    assert {m for m in after if m.startswith(("pymodbus.server", "aiohttp", "serial"))} == set()

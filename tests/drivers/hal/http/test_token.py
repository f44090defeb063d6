"""A bearer token from a file.

The bus reads the file for each call. If other users can read or write the file, the bus refuses it. The
bus never shows the token.
"""

import os
from pathlib import Path

import pytest

from drivers.hal import HalError
from drivers.hal.http import HttpBus, HttpSettings, warnings
from tests.drivers.hal.http.far_end import FarEnd, always, answer
from tests.drivers.hal.http.test_bus import Clock


def test_a_token_is_read_from_its_file_for_each_call(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.touch(mode=0o600)
    with FarEnd(always(answer())) as far:
        bus = HttpBus(HttpSettings(api_base=f"127.0.0.1:{far.port}", token_file=str(file)), Clock())
        for token in ("first", "second"):
            file.write_text(f"{token}\n")
            bus.get_json("/state")
        bus.close()
    sent = [line for r in far.requests for line in r.split(b"\r\n") if b"Auth" in line]
    assert sent == [b"Authorization: Bearer first", b"Authorization: Bearer second"]


@pytest.mark.parametrize("held", [None, b"", b"two words", b"two\nlines", b"\xff"])
def test_a_token_file_without_a_token_is_an_error_that_does_not_show_its_content(
    tmp_path: Path, held: bytes | None
) -> None:
    file = tmp_path / "token"
    if held is not None:
        file.touch(mode=0o600)
        file.write_bytes(held)
    bus = HttpBus(HttpSettings(api_base="127.0.0.1:1", token_file=str(file)), Clock())
    with pytest.raises(HalError, match="token_file") as caught:
        bus.get_json("/state")
    assert "words" not in str(caught.value)


def test_a_pipe_in_place_of_a_token_file_keeps_nobody_waiting(tmp_path: Path) -> None:
    file = tmp_path / "token"
    os.mkfifo(file, 0o600)
    bus = HttpBus(HttpSettings(api_base="127.0.0.1:1", token_file=str(file)), Clock())
    with pytest.raises(HalError) as caught:
        bus.get_json("/state")
    assert str(caught.value) == (
        f"token_file {file} cannot be read: it is a pipe, a socket or a device, not a file"
    )


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o644])
def test_a_token_file_that_others_can_read_or_write_is_refused_and_not_sent(
    tmp_path: Path, mode: int
) -> None:
    file = tmp_path / "token"
    file.write_text("secret\n")
    file.chmod(mode)
    with FarEnd(always(answer())) as far:
        bus = HttpBus(HttpSettings(api_base=f"127.0.0.1:{far.port}", token_file=str(file)), Clock())
        with pytest.raises(HalError) as caught:
            bus.get_json("/state")
        bus.close()
    assert str(caught.value) == f"token_file {file} is open to other users: chmod 600 {file}"
    assert far.requests == []


def test_a_token_over_plain_http_is_worth_a_warning() -> None:
    assert list(warnings(HttpSettings(api_base="tpu"))) == []
    [(path, text)] = warnings(HttpSettings(api_base="tpu", token_file="/etc/rmf-bridges/tpu.token"))
    assert (path, "unencrypted" in text) == (("token_file",), True)

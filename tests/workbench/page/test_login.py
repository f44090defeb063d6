"""The user that a reverse proxy names, in virtual time. A tab keeps the request that loaded it."""

from types import SimpleNamespace

import pytest
from fastapi.requests import HTTPConnection

from workbench.page import login
from workbench.page.access import IDLE_S
from workbench.page.login import Login

PROXY = "10.0.0.5"


def loaded(address: str = PROXY, user: bytes = b"ann") -> HTTPConnection:
    """Return a new request from this address."""
    headers = [(b"x-remote-user", user)] if user else []
    return HTTPConnection({"type": "http", "client": (address, 1), "headers": headers})


def test_a_tab_behind_a_proxy_ends_as_a_login_does(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr(login, "time", SimpleNamespace(monotonic=lambda: now[0]))
    users = Login(None, proxy=PROXY, header="X-Remote-User")
    idle, busy = loaded(), loaded()
    assert (users.user(idle), users.user(busy)) == ("ann", "ann")
    told = []
    for step in range(1, 15):
        now[0] = 1000.0 + step * 0.9 * IDLE_S
        told.append(users.user(busy))
    assert told == ["ann"] * 13 + [""]  # 13 * 0.9 h is less than twelve hours
    assert users.user(idle) == ""
    now[0] += 30 * 86400.0
    assert (users.user(idle), users.user(busy)) == ("", "")
    assert users.user(loaded()) == "ann"


def test_a_header_of_another_address_or_an_empty_one_names_nobody() -> None:
    users = Login(None, proxy=PROXY, header="X-Remote-User")
    assert [users.user(loaded("10.0.0.6")), users.user(loaded(user=b""))] == ["", ""]

"""The rules for access to the page, in virtual time. Passwords, sessions and login attempts decide who
may act."""

from pathlib import Path

import pytest

from workbench.page import access
from workbench.page.access import LoginSessions, PasswordCheck, PasswordError


@pytest.fixture(scope="module")
def stored() -> str:
    return access.hashed("correct horse")


def test_a_password_matches_its_own_hash_only(stored: str) -> None:
    assert access.matches("correct horse", stored)
    assert not access.matches("Correct horse", stored)
    assert "correct" not in stored


@pytest.mark.parametrize(
    "text",
    ["", "secret", "scrypt$1$2$3$x$y", "scrypt$1048576$8$1$AAAA$AAAA", "md5$1$8$1$AA==$AA=="],
)
def test_a_hash_that_is_not_ours_is_refused_without_computing_anything(text: str) -> None:
    with pytest.raises(PasswordError):
        access.matches("x", text)


def test_a_user_is_added_to_a_file_that_nobody_else_can_read(tmp_path: Path) -> None:
    file = tmp_path / "passwords"
    access.add_user(file, "ann", "long enough")
    access.add_user(file, "bob", "long enough")
    access.add_user(file, "ann", "another one")
    assert file.stat().st_mode & 0o777 == 0o600
    known = access.users(file)
    assert [*known] == ["ann", "bob"]
    assert access.matches("another one", known["ann"])


@pytest.mark.parametrize(("user", "password"), [("a:b", "long enough"), ("ann", "short")])
def test_an_impossible_user_or_a_short_password_is_not_added(
    tmp_path: Path, user: str, password: str
) -> None:
    with pytest.raises(PasswordError):
        access.add_user(tmp_path / "passwords", user, password)
    assert not (tmp_path / "passwords").exists()


@pytest.mark.parametrize(
    ("text", "mode", "why"),
    [
        ("", 0o600, "has no user"),
        ("ann:secret\n", 0o600, ":1: not a hash"),
        ("# people\nann\n", 0o600, ":2: not a hash"),
        ("", 0o644, "open to other users"),
    ],
)
def test_a_file_that_cannot_be_used_says_where_and_why(
    tmp_path: Path, text: str, mode: int, why: str
) -> None:
    file = tmp_path / "passwords"
    file.write_text(text)
    file.chmod(mode)
    with pytest.raises(PasswordError, match=why):
        access.users(file)


def test_after_five_wrong_passwords_an_address_waits_a_minute(stored: str) -> None:
    door = PasswordCheck({"ann": stored})
    wrong = "wrong user or password"
    waits = "too many wrong passwords; wait a minute"
    tries = [("ann", "x"), ("ann", "y"), ("eve", "correct horse"), ("ann", ""), ("ann", "z" * 9999)]
    assert [door.refuses(*one, "10.0.0.1", at) for at, one in enumerate(tries)] == [wrong] * 5
    assert door.refuses("ann", "correct horse", "10.0.0.1", 6.0) == waits
    assert door.refuses("ann", "correct horse", "10.0.0.2", 6.0) == ""
    assert door.refuses("ann", "correct horse", "10.0.0.1", 61.0) == ""


def test_ten_thousand_addresses_are_not_all_remembered() -> None:
    tries = access.Tries()
    for number in range(10_000):
        tries.failed(str(number), 0.0)
    assert len(tries._failed_at) == access.MOST_ADDRESSES


def test_a_session_ends_after_an_idle_hour_or_twelve_hours_or_a_logout() -> None:
    sessions = LoginSessions()
    idle, shift, out = (sessions.begin(user, 0.0) for user in ("ann", "bob", "eve"))
    sessions.end(out)
    assert sessions.find(out, 1.0) is None
    assert sessions.find(idle, access.IDLE_S + 1.0) is None
    hour = 0.9 * access.IDLE_S
    for step in range(13):
        found = sessions.find(shift, step * hour)
        assert found is not None
        assert found.user == "bob"
    assert sessions.find(shift, access.SESSION_S + 1.0) is None
    assert sessions.find("made up", 0.0) is None
    assert sessions.find(None, 0.0) is None


def test_sessions_are_bounded_and_the_newest_stay() -> None:
    sessions = LoginSessions()
    first = sessions.begin("ann", 0.0)
    for _ in range(access.MOST_SESSIONS):
        last = sessions.begin("bob", 0.0)
    assert sessions.find(first, 0.0) is None
    assert sessions.find(last, 0.0) is not None

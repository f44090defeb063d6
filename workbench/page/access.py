"""Access to the page's actions: passwords, login sessions, and a limit for failed logins.

A password file has a line `user:scrypt$N$r$p$salt$hash` for each user. `rmf-bridge page --add-user`
writes the line, with a new salt for each password (scrypt, RFC 7914, from Python's hashlib).
"""

import base64
import hashlib
import hmac
import os
import re
import secrets
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridges.system.files import replace
from bridges.system.user_files import OTHERS, read

COST: Final = (2**14, 8, 1)
"""Parameters N, r and p of scrypt. Each try takes 16 MB and about 50 ms."""
MOST_COST: Final = 2**17
SESSION_S: Final = 12 * 3600.0
"""Duration (s) of a login. Twelve hours are one shift."""
IDLE_S: Final = 3600.0
MOST_SESSIONS: Final = 100
TRIES: Final = 5
TRIES_IN_S: Final = 60.0
MOST_ADDRESSES: Final = 1000
SHORTEST: Final = 8
LONGEST_FILE: Final = 64 * 1024
USER: Final = re.compile(r"[A-Za-z0-9._@-]{1,64}")


class PasswordError(Exception):
    """A password file is unusable, or a user or password cannot be added."""


def hashed(password: str) -> str:
    """Return the password's hash with its salt, in the form of a password file."""
    salt = os.urandom(16)
    n, r, p = COST
    parts = (base64.b64encode(part).decode() for part in (salt, _scrypt(password, salt, n, r, p)))
    return "$".join(("scrypt", str(n), str(r), str(p), *parts))


def matches(password: str, stored: str) -> bool:
    """Return whether the password matches. Raises PasswordError if `stored` does not have the form that
    `hashed` returns."""
    cost, salt, wanted = _parts(stored)
    return hmac.compare_digest(_scrypt(password, salt, *cost), wanted)


def _parts(stored: str) -> tuple[tuple[int, int, int], bytes, bytes]:
    """Return three parts of the stored text: (N, r, p), the salt, and the hash. Raises
    PasswordError."""
    try:
        name, n, r, p, salt, expected = stored.split("$")
        cost = (int(n), int(r), int(p))
        raw, wanted = (base64.b64decode(part, validate=True) for part in (salt, expected))
    except ValueError:
        raise PasswordError("not a hash as `rmf-bridge page --add-user` writes it") from None
    if name != "scrypt" or cost[0] > MOST_COST or cost[1] > 16 or cost[2] > 4:
        raise PasswordError("not a hash as `rmf-bridge page --add-user` writes it")
    return cost, raw, wanted


def _scrypt(password: str, salt: bytes, n: int, r: int, p: int) -> bytes:
    return hashlib.scrypt(password.encode(), salt=salt, n=n, r=r, p=p, maxmem=2**28, dklen=32)


def users(file: Path) -> dict[str, str]:
    """Return user -> hash. Raises PasswordError, which names the file and line."""
    try:
        content, mode = read(file, LONGEST_FILE)
    except OSError as error:
        raise PasswordError(f"{file}: {error.strerror}") from None
    if mode & OTHERS:
        raise PasswordError(f"{file} is open to other users: chmod 600 {file}")
    if len(content) > LONGEST_FILE:
        raise PasswordError(f"{file} is too long for a password file")
    found: dict[str, str] = {}
    for number, line in enumerate(content.decode(errors="replace").splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        user, _, stored = line.partition(":")
        if not USER.fullmatch(user) or user in found:
            raise PasswordError(f"{file}:{number}: not a user name, or a name that came before")
        try:
            _parts(stored)
        except PasswordError as error:
            raise PasswordError(f"{file}:{number}: {error}") from None
        found[user] = stored
    if not found:
        raise PasswordError(f"{file} has no user; add a user with rmf-bridge page --add-user NAME")
    return found


def add_user(file: Path, user: str, password: str) -> None:
    """Add a user, or replace a user's password. Raises PasswordError."""
    if not USER.fullmatch(user):
        raise PasswordError(f"'{user}' is not a user name: use only letters, digits and . _ @ -")
    if len(password) < SHORTEST:
        raise PasswordError(f"the password is too short: use at least {SHORTEST} characters")
    known = users(file) if file.exists() else {}
    known[user] = hashed(password)
    text = "".join(f"{name}:{stored}\n" for name, stored in known.items())
    before = os.umask(OTHERS)
    try:
        replace(file, text.encode())
    except OSError as error:
        raise PasswordError(f"{file}: {error.strerror}") from None
    finally:
        os.umask(before)


class Tries:
    """The times of failed logins from each address. If there are too many addresses, the oldest address
    is forgotten."""

    def __init__(self) -> None:
        self._failed_at: OrderedDict[str, list[float]] = OrderedDict()

    def allowed(self, address: str, now: float) -> bool:
        """Return whether this address may try again."""
        recent = [at for at in self._failed_at.get(address, ()) if now - at < TRIES_IN_S]
        return len(recent) < TRIES

    def failed(self, address: str, now: float) -> None:
        """Count a failed try from this address."""
        recent = [at for at in self._failed_at.pop(address, ()) if now - at < TRIES_IN_S]
        self._failed_at[address] = [*recent, now]
        while len(self._failed_at) > MOST_ADDRESSES:
            self._failed_at.popitem(last=False)


@dataclass(slots=True)
class LoginSession:
    """A user's login. `proof` is a token that each form must send back, against forged forms (CSRF)."""

    user: str
    began_at: float
    used_at: float
    proof: str

    def use(self, now: float) -> bool:
        """Note a use of the session. Return False if the session is over."""
        if now - self.began_at > SESSION_S or now - self.used_at > IDLE_S:
            return False
        self.used_at = now
        return True


class LoginSessions:
    """Logins by cookie secret."""

    def __init__(self) -> None:
        self._by_secret: OrderedDict[str, LoginSession] = OrderedDict()

    def begin(self, user: str, now: float) -> str:
        """Begin a session, and return its secret. A user's earlier session ends."""
        secret = secrets.token_urlsafe(32)
        self._by_secret[secret] = LoginSession(user, now, now, secrets.token_urlsafe(16))
        while len(self._by_secret) > MOST_SESSIONS:
            self._by_secret.popitem(last=False)
        return secret

    def find(self, secret: str | None, now: float) -> LoginSession | None:
        """Return the session of this cookie. Return None if the session is unknown or over."""
        session = self._by_secret.get(secret or "")
        if session is None or secret is None:
            return None
        if session.use(now):
            return session
        del self._by_secret[secret]
        return None

    def end(self, secret: str | None) -> None:
        """End the session that has this secret."""
        self._by_secret.pop(secret or "", None)


class PasswordCheck:
    """A check of users' passwords, with a limit of tries for each address."""

    def __init__(self, known: Mapping[str, str]) -> None:
        self._known = known
        self._tries = Tries()
        self._nobody = hashed(secrets.token_urlsafe(16))

    def refuses(self, user: str, password: str, address: str, now: float) -> str:
        """Return the reason to refuse the login. Return "" for an accepted login.

        The check takes as long for an unknown user as for a known user. Thus nobody can find out user
        names from the time.
        """
        if not self._tries.allowed(address, now):
            return "too many wrong passwords; wait a minute"
        right = matches(password[:1024], self._known.get(user, self._nobody))
        if right and user in self._known:
            return ""
        self._tries.failed(address, now)
        return "wrong user or password"

"""The expiry dates of the certificates in PEM files. The program openssl reads them. No daemon imports
this file."""

import os
import re
import ssl
import subprocess
import time
from pathlib import Path
from typing import Final

from msgspec import Struct

DAY_S: Final = 86400
SOON_S: Final = 30 * DAY_S
"""The remaining validity (s) below which a certificate must be renewed."""
URGENT_S: Final = 7 * DAY_S
CHAIN_MAX: Final = 1 << 20
READ_S: Final = 5.0
END: Final = re.compile(r"^ +Not After : (.+)$", re.M)
Stamp = tuple[int, int, int]


class CertificateEnd(Struct, frozen=True):
    """The expiry of a file's certificate (wall s). If the file has several certificates, the earliest
    expiry counts. `reason`: the reason why the expiry is unknown. In this case `at` is None."""

    at: float | None
    reason: str = ""


def listing(file: object) -> tuple[str, ...]:
    """Return the command that shows a PEM file's certificates as text."""
    return ("openssl", "storeutl", "-noout", "-text", "-certs", str(file))


def first_end(shown: str) -> CertificateEnd:
    """Return the earliest expiry in the text that `listing` shows."""
    ends = [ssl.cert_time_to_seconds(found) for found in END.findall(shown)]
    return CertificateEnd(min(ends)) if ends else CertificateEnd(None, "it has no certificate")


def told(name: str, end: CertificateEnd, now: float) -> str:
    """Return a sentence that tells a person when the certificate `name` expires."""
    if end.at is None:
        return f"{name} cannot be read: {end.reason}"
    left, day = end.at - now, time.strftime("%Y-%m-%d", time.gmtime(end.at))
    if left < 0:
        return f"{name} ended {_days(-left)} ago, on {day}"
    return f"{name} ends in {_days(left)}, on {day}"


def _days(seconds: float) -> str:
    days = int(seconds // DAY_S)
    return f"{days} day{'s' * (days != 1)}" if days else f"{int(seconds // 3600)} h"


class CertificateReader:
    """Reads the expiry of certificates. If the expiry of a file is known, the file is read again only
    after a change."""

    def __init__(self) -> None:
        self._read: dict[str, tuple[Stamp, CertificateEnd]] = {}

    def end(self, file: str) -> CertificateEnd:
        """Return the expiry of this file's certificate."""
        try:
            found = Path(file).stat()
            stamp = (found.st_mtime_ns, found.st_ino, found.st_size)
            if file in self._read and self._read[file][0] == stamp:
                return self._read[file][1]
            with Path(file).open("rb"):
                end = _asked(file, found.st_size)
        except OSError as error:
            return CertificateEnd(None, error.strerror or str(error))
        if end.at is not None:
            self._read[file] = stamp, end
        return end


def _asked(file: str, size: int) -> CertificateEnd:
    if size > CHAIN_MAX:
        return CertificateEnd(None, f"it is larger than {CHAIN_MAX} bytes")
    try:
        done = subprocess.run(
            listing(file),
            env=os.environ | {"LC_ALL": "C"},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=READ_S,
        )
    except FileNotFoundError:
        return CertificateEnd(None, "openssl is not installed: sudo apt install openssl")
    except subprocess.TimeoutExpired:
        return CertificateEnd(None, f"openssl has not answered for {READ_S:g} s")
    return first_end(done.stdout.decode(errors="replace"))

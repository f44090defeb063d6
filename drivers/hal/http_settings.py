"""The section of an `http` bus in a YAML: the controller's address, the secrets, and the times."""

from typing import Annotated, Literal

import msgspec

from bridges.kinds.shared.fields import AbsolutePath, Name, Period, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal import BusSettings, Needs, Where
from drivers.hal.hosts import is_loopback, one_spelling
from drivers.hal.http_address import Path, base
from drivers.hal.http_login import Login

Method = Literal["POST", "PUT", "GET"]
"""The HTTP method of a command. Some makes take a command as a GET with a query."""
Header = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[A-Za-z][A-Za-z0-9-]{0,63}$(?!\n)",
        extra={"pattern": "the name of an HTTP header (X-API-Key)"},
    ),
]
Timeout = Annotated[float, msgspec.Meta(ge=0.1, le=5, extra={"unit": "s"})]
"""The timeout of a call. It is at most 5 s, because systemd could restart a daemon whose call takes
longer (`WatchdogSec=10` of the unit)."""


class HttpSettings(BusSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="http"):
    """A controller's HTTP API."""

    api_base: Annotated[
        Name, tells("the beginning of every address: host, port, path (`192.168.1.60:8080/api`).")
    ]
    timeout_s: Annotated[
        Timeout, tells("how long a whole call may take, from the name lookup to the last byte.")
    ] = 1.0
    scan_s: Annotated[Period, tells("how often the controller is read.")] = 1.0
    token_file: Annotated[
        Name | None, tells("a file with a bearer token or API key, which only the daemon may read.")
    ] = None
    token_header: Annotated[
        Header | None,
        tells("""the header of the token (`X-API-Key`). Without this key the header is
        `Authorization: Bearer …`."""),
    ] = None
    login: Annotated[
        Login | None, tells("the user and password of a controller without tokens.")
    ] = None
    accept_unencrypted: Annotated[
        Name | None,
        tells("""the reason why a token or a password may go over the network unencrypted. `check`
        prints the reason."""),
    ] = None
    push_path: Annotated[
        Path | None,
        tells("""a WebSocket below `api_base`. At each of its messages the driver reads the
        controller at once. The content of the message is not used."""),
    ] = None
    ca_file: Annotated[
        AbsolutePath | None,
        tells("""with https, a PEM file with the controller's certificate, or with the certificate
        of the authority that signed it. Without this file the daemon trusts the public
        authorities."""),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem for an invalid address, and for each setting without effect."""
        try:
            tls = base(self.api_base).scheme == "https"
        except ValueError as error:
            yield ("api_base",), str(error)
            return
        if self.ca_file and not tls:
            yield (
                ("ca_file",),
                "has no effect without https: let api_base begin with https://, or delete ca_file",
            )
        if self.token_header and not self.token_file:
            yield (
                ("token_header",),
                "needs token_file, which names the file with the header's value",
            )
        if self.login and self.token_file and not self.token_header:
            yield (
                ("login",),
                "sends the header Authorization, as token_file does: delete login or token_file",
            )
        if self.push_path and self.login and self.login.method == "digest":
            yield ("push_path",), "a WebSocket has no digest login: delete push_path"
        readable = _readable_secret(self)
        if readable == "login" and not self.accept_unencrypted:
            text = (
                "with method: basic anybody on the network can read the password. If the controller"
                " has https or digest, write https://… or method: digest. Otherwise write"
                " accept_unencrypted: <why it is safe>"
            )
            yield ("login",), text
        if self.accept_unencrypted and not readable:
            yield (
                ("accept_unencrypted",),
                "no secret goes over the network unencrypted: delete this key",
            )


def _readable_secret(settings: HttpSettings) -> Literal["login", "token_file", ""]:
    """Return the setting whose secret would leave this machine unencrypted. Return "" if every secret
    is encrypted or the settings have no secret."""
    basic = settings.login is not None and settings.login.method == "basic"
    if not basic and not settings.token_file:
        return ""
    where = base(settings.api_base)
    if where.scheme == "https" or is_loopback(where.host):
        return ""
    return "login" if basic else "token_file"


def warnings(settings: HttpSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    readable = _readable_secret(settings)
    if readable and settings.accept_unencrypted:
        text = f"the secret goes over the network unencrypted: {settings.accept_unencrypted}"
        yield ("accept_unencrypted",), text
    elif readable:
        text = (
            "the token goes over the network unencrypted: write https://… where the controller has"
            " it, or keep such controllers on a network of their own"
        )
        yield ("token_file",), text


def needs(settings: HttpSettings) -> Needs:
    """Return the permission to reach the controller's address."""
    return Needs(host=base(settings.api_base).host)


def where(settings: HttpSettings) -> Where:
    """Return the controller's address, which is the hardware that the bus uses."""
    api = base(settings.api_base)
    return Where(api._replace(host=one_spelling(api.host)).url(""), local=False)

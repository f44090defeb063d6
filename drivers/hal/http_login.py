"""A user and password for HTTP: basic (RFC 7617) or digest (RFC 7616), by requests.

A digest takes two requests: the controller refuses the first one with a challenge, and does nothing.
Later requests carry the challenge's nonce from the start, for as long as the controller accepts it.
"""

import base64
from typing import TYPE_CHECKING, Annotated, Literal

import msgspec

from bridges.kinds.shared.fields import AbsolutePath, tells
from bridges.system import user_files
from drivers.hal import HalError

if TYPE_CHECKING:
    from requests import PreparedRequest, Response

User = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[!-9;-~]{1,64}$(?!\n)",
        extra={"pattern": "a user name without spaces or colons (robot)"},
    ),
]


class Login(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A user of the controller."""

    user: Annotated[User, tells("the user's name.")]
    password_file: Annotated[
        AbsolutePath, tells("a file with the password, which only the daemon may read.")
    ]
    method: Annotated[
        Literal["digest", "basic"],
        tells("`digest` hides the password; `basic` does not, so it needs https."),
    ]


class Signer:
    """Signs requests for one user. The password is read for each call: it may be renewed meanwhile."""

    def __init__(self, login: Login) -> None:
        from requests.auth import HTTPDigestAuth

        self._login = login
        self._digest = HTTPDigestAuth(login.user, "")

    def sign(self, request: "PreparedRequest") -> None:
        """Sign the request, as far as it can be signed before a challenge. Raises HalError."""
        if self._login.method == "basic":
            request.headers.update(self.basic())
        else:
            self._digest.password = self._password()
            self._digest(request)

    def basic(self) -> dict[str, str]:
        """Return the header of basic authentication. Raises HalError."""
        pair = f"{self._login.user}:{self._password()}".encode()
        return {"Authorization": f"Basic {base64.b64encode(pair).decode()}"}

    def is_challenge(self, answer: "Response") -> bool:
        """Does this answer ask for a digest?"""
        asked = answer.headers.get("WWW-Authenticate", "").lower()
        digest = self._login.method == "digest" and asked.startswith("digest ")
        return digest and answer.status_code == 401

    def answered(self, answer: "Response", verify: bool | str) -> "Response":
        """Send the challenged request again, signed; return its answer. A second challenge is the
        answer then, a refusal. The body of the challenge is not read."""
        answer.raw.close()
        signed: Response = self._digest.handle_401(  # type: ignore[no-untyped-call]
            answer, stream=True, verify=verify
        )
        return signed

    def _password(self) -> str:
        try:
            return user_files.secret_line("password_file", self._login.password_file, "password")
        except user_files.SecretError as error:
            raise HalError(str(error)) from None

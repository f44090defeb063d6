"""A user and password for HTTP: basic (RFC 7617) or digest (RFC 7616), through the library requests.

The first digest login takes two requests. The controller answers the first request with a challenge,
and does nothing else. The second request is signed with the challenge's nonce. All later requests are
signed with the same nonce, until the controller refuses it.
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
        AbsolutePath, tells("a file with the password. Only the daemon may have read access to it.")
    ]
    method: Annotated[
        Literal["digest", "basic"],
        tells("`digest` hides the password; `basic` does not, so it needs https."),
    ]


class Signer:
    """Signs requests for one user. Each call reads the password file again, because somebody may have
    changed the password."""

    def __init__(self, login: Login) -> None:
        from requests.auth import HTTPDigestAuth

        self._login = login
        self._digest = HTTPDigestAuth(login.user, "")

    def sign(self, request: "PreparedRequest") -> None:
        """Sign the request. A digest needs a challenge, so a request before the first challenge stays
        unsigned. Raises HalError."""
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
        """Return whether this answer asks for a digest."""
        asked = answer.headers.get("WWW-Authenticate", "").lower()
        digest = self._login.method == "digest" and asked.startswith("digest ")
        return digest and answer.status_code == 401

    def answered(self, answer: "Response", verify: bool | str) -> "Response":
        """Sign the request that the controller has challenged, send the request again, and return its
        answer. A second challenge counts as a refusal. Do not read the body of the challenge."""
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

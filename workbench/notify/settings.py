"""The file of `rmf-bridge notify`: the recipients, and which notices each recipient gets.

page: https://rmf.hospital.example       # optional: the web page to which notices link
quiet: {from: "22:00", to: "06:00"}      # optional: warnings wait until the end of this time
to:
  - {ntfy: "https://ntfy.sh/our-topic", token_file: /etc/rmf-bridges/ntfy.token}
  - {webhook: "https://chat.example/hook", least: critical}
  - {mail: [lifts@hospital.example], from: rmf@hospital.example, host: mail.hospital.example}
"""

from datetime import time
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from bridges.kinds.shared.fields import AbsolutePath, Name, Patience, Seconds, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.yaml.parsing import Sort, YamlFile, compose, read
from bridges.yaml.positions import Spot
from bridges.yaml.values import BROKEN, Values

SORT = Sort("file of notify", "to: ...", 64 * 1024, 2_000)
Severity = Literal["warning", "critical"]
Url = Annotated[
    str,
    Meta(
        max_length=2048,
        pattern=r"^https?://[!-.0-~][!-~]*$(?!\n)",
        extra={"pattern": "an address such as https://host.example/path"},
    ),
]
Clock = Annotated[
    str,
    Meta(
        pattern=r"^([01][0-9]|2[0-3]):[0-5][0-9]$(?!\n)",
        extra={"pattern": 'a time of day in quotes, such as "22:00"'},
    ),
]


class QuietHours(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The time of day in which only critical notices are sent."""

    begins: Annotated[Clock, tells("the beginning of the quiet hours.")] = msgspec.field(
        name="from"
    )
    ends: Annotated[
        Clock, tells("the end of the quiet hours; a time before `from` is on the next day.")
    ] = msgspec.field(name="to")

    def contains(self, at: time) -> bool:
        """Return whether this time of day is in the quiet hours."""
        begins, ends = time.fromisoformat(self.begins), time.fromisoformat(self.ends)
        if begins <= ends:
            return begins <= at < ends
        return at >= begins or at < ends


class Recipient(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One recipient, with exactly one of `ntfy`, `webhook` and `mail`."""

    ntfy: Annotated[Url | None, tells("the address of an ntfy topic.")] = None
    webhook: Annotated[Url | None, tells("an address that takes a JSON object by POST.")] = None
    mail: Annotated[list[Name], Meta(max_length=20), tells("addresses for mail.")] = []
    least: Annotated[
        Severity, tells("`critical`: send only critical notices, for example of a silent device.")
    ] = "warning"
    token_file: Annotated[
        AbsolutePath | None,
        tells(
            "a file with a bearer token or a mail password; only this program's user may read it."
        ),
    ] = None
    ca_file: Annotated[
        AbsolutePath | None,
        tells("the certificate (PEM) of the server's authority, if it is not a public one."),
    ] = None
    host: Annotated[Name | None, tells("the mail server.")] = None
    port: Annotated[
        int, Meta(ge=1, le=65535), tells("the mail server's port; TLS is required.")
    ] = 587
    user: Annotated[Name | None, tells("the user at the mail server.")] = None
    sender: Annotated[Name | None, tells("the address of the sender of mail.")] = msgspec.field(
        name="from", default=None
    )

    @property
    def name(self) -> str:
        """The recipient's name in the log, without a path that may hold a secret."""
        if self.mail:
            return f"mail to {', '.join(self.mail)}"
        way, url = ("ntfy", self.ntfy) if self.ntfy else ("webhook", self.webhook or "")
        return f"{way} at {(url or '').split('/')[2]}"

    def problems(self) -> Remarks:
        """Yield a problem if the recipient has none or several of ntfy, webhook and mail. Also yield a
        problem if the settings for mail are incomplete."""
        ways = [bool(self.ntfy), bool(self.webhook), bool(self.mail)]
        if sum(ways) != 1:
            yield (
                (),
                "write exactly one of ntfy, webhook and mail; add another entry for a second one",
            )
            return
        mails = {"host": self.host, "from": self.sender}
        for key, value in mails.items():
            if self.mail and not value:
                yield ("mail",), f"needs {key} too"
            if value and not self.mail:
                yield (key,), "is only for mail"
        if self.user and not (self.mail and self.token_file):
            yield (
                ("user",),
                "is only for mail, and needs token_file, the file with the user's password",
            )


class NotifySettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The recipients of notices, and the rules for when a notice is sent."""

    to: Annotated[list[Recipient], Meta(min_length=1, max_length=20), tells("the recipients.")]
    page: Annotated[
        Url | None, tells("the address of `rmf-bridge page`, to which notices link.")
    ] = None
    quiet: Annotated[
        QuietHours | None, tells("a time of day in which only critical notices are sent.")
    ] = None
    certificates: Annotated[
        list[AbsolutePath],
        Meta(max_length=20),
        tells("more certificates of this machine; a notice tells when each of them expires."),
    ] = []
    after_s: Annotated[Patience, tells("how long a trouble must last before its first notice.")] = (
        30.0
    )
    over_s: Annotated[
        Patience, tells("how long a trouble must be gone before the notice of its end.")
    ] = 60.0
    waits_s: Annotated[Patience, tells("a robot that waits longer than this is a trouble.")] = 300.0
    stuck_s: Annotated[
        Patience,
        tells("if nothing changes for this long at a lift that a robot has, it is critical."),
    ] = 180.0
    again_s: Annotated[
        Seconds, tells("a critical notice is repeated after this long without --ack; 0: never.")
    ] = 900.0


def load(file: Path) -> NotifySettings:
    """Read the file. Raises SettingsError, which lists every problem found."""
    page = YamlFile(str(file))
    root = compose(page, read(str(file), SORT), SORT)
    found = Values(page).make(NotifySettings, Spot(root, root, "the file"))
    page.check()
    assert found is not BROKEN  # if there was a problem, `check` has raised
    return found

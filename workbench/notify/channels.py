"""Three ways to send a notice: to a webhook, to an ntfy topic, or by a mail server.

Every way raises ChannelError if the recipient did not accept the notice. For ntfy, the notice is sent
with headers (docs.ntfy.sh/publish: Title, Priority, Tags, Click, Authorization). Mail is sent only over
TLS: with STARTTLS, or with TLS from the beginning on port 465 (RFC 8314).
"""

import smtplib
import ssl
from collections.abc import Mapping
from email.header import Header
from email.message import EmailMessage
from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.system.user_files import SecretError, secret_line
from workbench.notify.messages import NoticeText
from workbench.notify.settings import Recipient

TIMEOUT_S: Final = 10.0
SMTPS: Final = 465
PRIORITY: Final = {"critical": "5", "warning": "3"}


class ChannelError(Exception):
    """The recipient did not accept the notice. The error's text gives the reason, without secrets."""


def send(to: Recipient, notice: NoticeText) -> None:
    """Send a notice. Sending may take a few times TIMEOUT_S. Raises ChannelError."""
    try:
        secret = secret_line("token_file", to.token_file, "token") if to.token_file else ""
    except SecretError as error:
        raise ChannelError(str(error)) from None
    if to.mail:
        _mail(to, notice, secret)
    elif to.ntfy:
        _post(to, to.ntfy, notice.text.encode(), _ntfy_headers(notice) | _bearer(secret))
    else:
        assert to.webhook  # `Recipient.problems` refuses a recipient without ntfy, mail or webhook
        headers = {"Content-Type": "application/json"} | _bearer(secret)
        told = replace(notice, text=f"{notice.title}\n{notice.text}")  # a chat shows only `text`
        _post(to, to.webhook, msgspec.json.encode(told), headers)


def _bearer(secret: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {secret}"} if secret else {}


def _ntfy_headers(notice: NoticeText) -> dict[str, str]:
    tag = "white_check_mark" if notice.event == "over" else "warning"
    title = Header(notice.title, "utf-8", maxlinelen=10_000).encode()  # ntfy decodes RFC 2047
    click = {"Click": notice.link} if notice.link else {}
    return {"Title": title, "Priority": PRIORITY[notice.severity], "Tags": tag} | click


def _post(to: Recipient, url: str, body: bytes, headers: Mapping[str, str]) -> None:
    import requests

    with requests.Session() as session:
        session.trust_env = False
        try:
            answer = session.post(
                url,
                data=body,
                headers=headers,
                timeout=TIMEOUT_S,
                allow_redirects=False,
                stream=True,
                verify=to.ca_file or True,
            )
        except (requests.RequestException, OSError) as error:
            raise ChannelError(f"{type(error).__name__}") from None
        with answer:
            if not answer.ok or answer.is_redirect:
                raise ChannelError(f"it answers {answer.status_code} {answer.reason}")


def _mail(to: Recipient, notice: NoticeText, password: str) -> None:
    message = EmailMessage()
    message["Subject"], message["From"] = f"[rmf-bridges] {notice.title}", to.sender
    message["To"] = ", ".join(to.mail)
    message.set_content("\n\n".join(filter(None, (notice.text, notice.link))))
    try:
        context = ssl.create_default_context(cafile=to.ca_file)
        with _server(to, context) as server:
            if to.user:
                server.login(to.user, password)
            server.send_message(message)
    except (OSError, smtplib.SMTPException) as error:
        raise ChannelError(f"{type(error).__name__}: {error}") from None


def _server(to: Recipient, context: ssl.SSLContext) -> smtplib.SMTP:
    assert to.host  # `Recipient.problems` refuses mail without `host`
    if to.port == SMTPS:
        return smtplib.SMTP_SSL(to.host, to.port, timeout=TIMEOUT_S, context=context)
    server = smtplib.SMTP(to.host, to.port, timeout=TIMEOUT_S)
    server.starttls(context=context)
    return server

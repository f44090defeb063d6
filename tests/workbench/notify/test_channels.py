"""The ways to send notices to people, over real HTTP and with a real mail server."""

import json
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from email import message_from_bytes, policy
from email.header import decode_header, make_header
from email.message import EmailMessage
from pathlib import Path
from typing import Any

import pytest
import trustme
from aiosmtpd.controller import Controller
from aiosmtpd.smtp import AuthResult
from msgspec.structs import replace

from bridges.yaml.problems import SettingsError
from tests.transports.zenoh_programs import free_port
from tests.workbench.notify.sink import Sink
from workbench.notify.channels import ChannelError, send
from workbench.notify.messages import NoticeText
from workbench.notify.settings import Recipient, load

NOTICE = NoticeText(
    "new", "critical", "lift Aufzug: STUCK", "Aufzug 1 steht ✋", "It stands.", "http://p/x"
)


@pytest.fixture
def token(tmp_path: Path) -> Path:
    file = tmp_path / "token"
    file.write_text("s3cret\n")
    file.chmod(0o600)
    return file


def test_a_webhook_gets_json_and_ntfy_gets_its_headers(sink: Sink, token: Path) -> None:
    send(Recipient(webhook=sink.url), NOTICE)
    send(Recipient(ntfy=sink.url, token_file=str(token)), NOTICE)
    (_, body), (headers, text) = sink.got
    assert json.loads(body) == {
        "event": "new",
        "severity": "critical",
        "key": "lift Aufzug: STUCK",
        "title": "Aufzug 1 steht ✋",
        "text": "Aufzug 1 steht ✋\nIt stands.",
        "at": "",
        "link": "http://p/x",
    }
    assert str(make_header(decode_header(headers["Title"]))) == "Aufzug 1 steht ✋"
    assert (headers["Priority"], headers["Click"]) == ("5", "http://p/x")
    assert (headers["Authorization"], text) == ("Bearer s3cret", b"It stands.")


@pytest.mark.parametrize("status", [302, 401, 500])
def test_a_refusal_is_an_error_without_the_secret_or_the_path(
    sink: Sink, token: Path, status: int
) -> None:
    sink.status = status
    with pytest.raises(ChannelError) as caught:
        send(Recipient(webhook=sink.url, token_file=str(token)), NOTICE)
    assert str(status) in str(caught.value)
    assert "s3cret" not in str(caught.value)
    assert "secret-path" not in Recipient(webhook=sink.url).name
    assert len(sink.got) == 1


def test_a_server_that_is_not_there_and_a_token_that_others_can_read_are_errors(
    token: Path,
) -> None:
    with pytest.raises(ChannelError, match="ConnectionError"):
        send(Recipient(webhook="http://127.0.0.1:1/x"), NOTICE)
    token.chmod(0o644)
    with pytest.raises(ChannelError, match="chmod 600"):
        send(Recipient(ntfy="http://127.0.0.1:1/x", token_file=str(token)), NOTICE)


class Mailbox:
    """The mails that a mail server has received."""

    def __init__(self) -> None:
        self.mails: list[EmailMessage] = []

    async def handle_DATA(self, _server: object, _session: object, envelope: Any) -> str:
        mail = message_from_bytes(envelope.content, policy=policy.default)
        self.mails.append(mail)
        return "250 OK"


@contextmanager
def mail_server(tmp_path: Path) -> Iterator[tuple[Mailbox, int]]:
    authority = trustme.CA()
    authority.cert_pem.write_to_path(tmp_path / "ca.pem")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.issue_cert("localhost").configure_cert(context)

    def allowed(
        _server: object, _session: object, _way: object, _how: object, data: Any
    ) -> AuthResult:
        right = (data.login, data.password) == (b"rmf", b"s3cret")
        return AuthResult(success=right, handled=False)

    box = Mailbox()
    running = Controller(
        box,
        hostname="localhost",
        port=(port := free_port()),
        tls_context=context,
        require_starttls=True,
        auth_required=True,
        authenticator=allowed,
    )
    running.start()
    try:
        yield box, port
    finally:
        running.stop()


def test_mail_goes_over_tls_with_its_password_and_a_wrong_one_is_an_error(
    tmp_path: Path, token: Path
) -> None:
    with mail_server(tmp_path) as (box, port):
        to = Recipient(
            mail=["lifts@h.example"],
            sender="rmf@h.example",
            host="localhost",
            port=port,
            user="rmf",
            token_file=str(token),
            ca_file=str(tmp_path / "ca.pem"),
        )
        with pytest.raises(ChannelError, match="CERTIFICATE_VERIFY_FAILED"):
            send(replace(to, ca_file=None), NOTICE)
        send(to, NOTICE)
        (mail,) = box.mails
        assert mail["Subject"] == "[rmf-bridges] Aufzug 1 steht ✋"
        assert mail.get_content().split() == ["It", "stands.", "http://p/x"]
        token.write_text("wrong\n")
        with pytest.raises(ChannelError, match="SMTPAuthenticationError") as caught:
            send(to, NOTICE)
        assert "wrong" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("to: []", "to"),
        ("to: [{least: critical}]", "exactly one of ntfy, webhook and mail"),
        ("to: [{webhook: 'https://x/y', ntfy: 'https://x/y'}]", "exactly one"),
        ("to: [{mail: [a@b]}]", "needs host too"),
        ("to: [{webhook: 'https://x/y', host: z}]", "only for mail"),
        ("to: [{webhook: 'x/y'}]", "an address such as https://host.example/path"),
        ("to: [{webhook: 'https:///y'}]", "an address such as https://host.example/path"),
        ("to: [{webhook: 'https://x/y'}]\nquiet: {from: '25:00', to: '06:00'}", "a time of day"),
        ("to: [{webhook: 'https://x/y'}]\nafters: 3", "after_s"),
        ("to: [{webhook: 'https://x/y', token: abc}]", "token_file"),
    ],
)
def test_a_wrong_file_is_refused_with_its_line_and_what_to_write(
    tmp_path: Path, text: str, says: str
) -> None:
    file = tmp_path / "to.yaml"
    file.write_text(text)
    with pytest.raises(SettingsError) as caught:
        load(file)
    assert says in "\n".join(map(str, caught.value.problems))
    assert f"{file}:" in str(caught.value.problems[0])

"""`doctor --hardening`, which judges each point of docs/how-to/harden.md. The doctor names the points
that it cannot judge."""

import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

from bridges import cli
from bridges.settings.config import Config
from bridges.settings.load import load, understood
from bridges.system.directories import user_of
from tests.workbench.commissioning.doctor.made_up import MadeUp
from workbench.commissioning.doctor import hardening as points
from workbench.commissioning.doctor.hardening import hardening

ROOT = Path(__file__).parents[4]
PAGE = ROOT / "docs/how-to/harden.md"
LIFT = (ROOT / "config/lift_dry_contact.yaml").read_text()
SUBJECTS = (
    points.GRAPH, points.WIRES, points.FIREWALL, points.ROOT, points.FILES, points.USERS,
    points.UPDATES,
)  # fmt: skip
TLS = """{transport: zenoh, zenoh: {connect: [tls/rmf:7447], tls: {ca: /etc/rmf-bridges/ca.pem,
  certificate: /etc/rmf-bridges/lift.pem, private_key: /etc/rmf-bridges/lift.key}}}"""
DROPS = """table inet filter {
  chain input { type filter hook input priority filter; policy drop;
    tcp dport 22 accept
  }
  chain forward { type filter hook forward priority filter; policy accept; }
}
"""
HEAD = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt uid timeout inode\n"


@pytest.fixture
def made(tmp_path: Path) -> MadeUp:
    (tmp_path / "machine").mkdir()
    return MadeUp(tmp_path / "machine", installed=())


def config(rmf: str = "{transport: dds}", text: str = LIFT) -> Config:
    """Return the config of an example with these `rmf` settings, as if its file were in
    /etc/rmf-bridges."""
    body = re.sub(r"^rmf:\n(  .*\n|\n)*", "", text, flags=re.M)
    file = Path("/etc/rmf-bridges/lift.yaml")
    return understood(file, f"rmf: {rmf}\n{body}".encode())


def found(made: MadeUp, subject: str, of: Config | None = None) -> list[tuple[str, str]]:
    """Return (level, fact) for each finding about a subject."""
    return [
        (one.level, one.found)
        for one in hardening(of or config(), made.machine)
        if one.subject == subject
    ]


def levels(made: MadeUp, subject: str, of: Config | None = None) -> list[str]:
    return [level for level, _ in found(made, subject, of)]


def test_each_point_is_a_heading_of_the_page() -> None:
    headings = re.findall(r"^## (.*)$", PAGE.read_text(), re.M)
    assert headings == [*SUBJECTS, "Seen"]


def test_a_machine_that_shows_nothing_is_unknown_and_never_well(made: MadeUp) -> None:
    of = config(TLS)
    assert {one.level for one in hardening(of, made.machine) if one.subject != points.WIRES} == {
        "ok",  # the certificates in the YAML, and a machine without sshd
        "unknown",
    }
    for subject in (points.FIREWALL, points.ROOT, points.FILES, points.UPDATES):
        assert set(levels(made, subject, of)) == {"unknown"}, subject


@pytest.mark.parametrize(
    ("rmf", "wanted"),
    [
        ("{transport: dds}", ["warning"]),
        ("{transport: dds, network: localhost}", ["ok"]),
        ("{transport: zenoh}", ["warning", "unknown"]),
        ("{transport: zenoh, zenoh: {connect: [tls/rmf:7447]}}", ["warning", "unknown"]),
        (TLS, ["ok", "unknown"]),
        (TLS.replace("tls/rmf:7447", "tls/rmf:7447, tcp/spare:7447"), ["warning", "unknown"]),
        *(
            (
                TLS.replace("connect:", f"mode: {mode}, listen: [{listen}], connect:"),
                [level, "unknown"],
            )
            for mode, listen, level in (
                ("peer", "tcp/0.0.0.0:7448", "warning"),
                ("peer", "tls/0.0.0.0:7448", "ok"),
                ("peer", "tcp/127.0.0.1:0", "ok"),
                ("auto", "tcp/0.0.0.0:7448", "warning"),
                ("client", "tcp/0.0.0.0:7448", "ok"),
            )
        ),
        ("{transport: ros2}", ["unknown"]),
        ("{transport: auto}", ["warning", "unknown"]),
    ],
)
def test_the_graph_is_judged_by_the_yaml(made: MadeUp, rmf: str, wanted: list[str]) -> None:
    assert levels(made, points.GRAPH, config(rmf)) == wanted


@pytest.mark.parametrize(
    ("strategy", "wanted"), [("Enforce", ["ok"]), ("Permissive", ["warning"]), ("", ["warning"])]
)
def test_sros_counts_only_if_the_service_enforces_it(
    made: MadeUp, strategy: str, wanted: list[str]
) -> None:
    environment = f"ROS_SECURITY_ENABLE=true ROS_SECURITY_STRATEGY={strategy}"
    made.command("systemctl", f"User=rmf-bridge\nEnvironment={environment}\nLoadState=loaded\n")
    assert levels(made, points.GRAPH, config("{transport: ros2}")) == wanted


@pytest.mark.parametrize(
    ("example", "wanted"),
    [
        ("lift_dry_contact", "ok"),
        ("charger_http", "warning"),
        ("lift_gateway", "unknown"),
        ("door_rs485", "ok"),
        ("charger_wiferion", "ok"),
    ],
)
def test_a_field_wire_is_judged_by_its_bus(made: MadeUp, example: str, wanted: str) -> None:
    of = load(ROOT / f"config/{example}.yaml")
    assert levels(made, points.WIRES, of)[0] == wanted


def test_an_encrypted_controller_is_well(made: MadeUp) -> None:
    text = (ROOT / "config/charger_http.yaml").read_text()
    secure = text.replace('api_base: "', 'api_base: "https://')
    assert levels(made, points.WIRES, config(text=secure))[0] == "ok"


@pytest.mark.parametrize(("said", "wanted"), [("0\n", "ok"), ("1\n", "warning")])
def test_a_machine_between_two_networks_must_not_forward(
    made: MadeUp, said: str, wanted: str
) -> None:
    made.write("/proc/sys/net/ipv4/ip_forward", said)
    assert levels(made, points.WIRES)[-1] == wanted


@pytest.mark.parametrize(
    ("rules", "wanted"),
    [
        (DROPS, ("ok", "the firewall drops every incoming packet that its rules do not accept")),
        (
            DROPS.replace("policy drop", "policy accept"),
            ("warning", "no input chain has the policy drop"),
        ),
        ("", ("warning", "nft shows no input chain")),
        (
            "table inet filter {\n chain forward { type filter hook forward; policy drop; } }",
            ("warning", "nft shows no input chain"),
        ),
        (
            DROPS.replace("table inet", "table ip"),
            ("warning", "only ip packets are dropped by policy"),
        ),
        (
            DROPS.replace("table inet", "table ip") + DROPS.replace("table inet", "table ip6"),
            ("ok", "the firewall drops every incoming packet that its rules do not accept"),
        ),
    ],
)
def test_a_firewall_must_drop_by_its_policy(
    made: MadeUp, rules: str, wanted: tuple[str, str]
) -> None:
    made.command("nft", rules)
    assert found(made, points.FIREWALL)[0] == wanted


def test_the_firewall_of_the_page_is_well(made: MadeUp) -> None:
    block = re.findall(r"^```\n(table inet .*?)^```$", PAGE.read_text(), re.M | re.S)[0]
    made.command("nft", block)
    assert levels(made, points.FIREWALL)[0] == "ok"


def test_ports_that_other_machines_reach_are_listed_and_loopback_is_not(made: MadeUp) -> None:
    tcp = (
        "   0: 00000000:0016 00000000:0000 0A 0:0 00:0 0 0 0 1\n"
        "   1: 0100007F:1F90 00000000:0000 0A 0:0 00:0 0 0 0 2\n"
        "   2: 0A01A8C0:D431 0501A8C0:1D17 01 0:0 00:0 0 0 0 3\n"
    )
    made.write("/proc/net/tcp", HEAD + tcp)
    nobody = "00000000000000000000000000000000:0000 0A 1"
    six = (
        f"   0: 00000000000000000000000001000000:0277 {nobody}\n"
        f"   1: 0000000000000000FFFF00000100007F:0278 {nobody}\n"
        f"   2: 000080FE00000000FF0025020100007F:1F91 {nobody}\n"
    )
    made.write("/proc/net/tcp6", HEAD + six)
    udp = "   0: 00000000:1CE8 00000000:0000 07 0:0 00:0 0 0 0 4\n"
    made.write("/proc/net/udp", HEAD + udp)
    text = "open to other machines, if the firewall permits: tcp 22, tcp 8081, udp 7400"
    assert found(made, points.FIREWALL)[1] == ("note", text)
    made.write("/proc/net/tcp", HEAD)
    made.write("/proc/net/tcp6", HEAD)
    made.write("/proc/net/udp", HEAD)
    assert levels(made, points.FIREWALL)[1] == "ok"


@pytest.mark.parametrize(
    ("mounts", "wanted"),
    [
        ("/dev/mmcblk0p2 / ext4 rw,noatime 0 0\n", "warning"),
        ("/dev/mmcblk0p2 / ext4 ro,noatime 0 0\n", "ok"),
        ("overlay / overlay rw,lowerdir=/lower 0 0\n", "ok"),
        ("rootfs / rootfs ro 0 0\n/dev/sda1 / ext4 rw 0 0\n", "warning"),
        ("tmpfs /run tmpfs rw 0 0\n", "unknown"),
    ],
)
def test_the_root_is_read_only_or_an_overlay(made: MadeUp, mounts: str, wanted: str) -> None:
    made.write("/proc/mounts", mounts)
    assert levels(made, points.ROOT) == [wanted]


def test_files_are_judged_by_their_modes_and_owners(made: MadeUp) -> None:
    for name, mode in {"lift.yaml": 0o644, "ca.pem": 0o644, "lift.pem": 0o644}.items():
        made.write(f"/etc/rmf-bridges/{name}", mode=mode)
    made.write("/etc/rmf-bridges/lift.key", mode=0o600)
    (made.root / "etc/rmf-bridges").chmod(0o755)
    assert levels(made, points.FILES, config(TLS)) == ["ok"]
    made.write("/etc/rmf-bridges/lift.key", mode=0o640)
    made.write("/etc/rmf-bridges/lift.yaml", mode=0o664)
    assert found(made, points.FILES, config(TLS)) == [
        ("wrong", "/etc/rmf-bridges/lift.yaml has mode 664"),
        ("wrong", "/etc/rmf-bridges/lift.key has mode 640"),
    ]
    (made.root / "etc/rmf-bridges/lift.key").unlink()
    assert found(made, points.FILES, config(TLS))[-1] == (
        "unknown",
        "owner and mode of /etc/rmf-bridges/lift.key: No such file or directory",
    )
    made.write("/etc/rmf-bridges/lift.key", mode=0o600)
    made.write("/etc/rmf-bridges/lift.yaml", mode=0o644)
    made.machine = replace(made.machine, root_uid=os.geteuid() + 1)
    told = found(made, points.FILES, config(TLS))
    assert {level for level, _ in told} == {"wrong"}
    assert ("wrong", "/etc/rmf-bridges/lift.yaml does not belong to root") in told
    assert ("wrong", "/etc/rmf-bridges/lift.key does not belong to root") not in told


@pytest.mark.parametrize(
    ("user", "mode", "well"),
    [(user_of("lift"), 0o600, True), (user_of("lift"), 0o644, False), ("pi", 0o600, False)],
)
def test_a_yaml_that_others_cannot_read_may_belong_to_the_services_user(
    made: MadeUp, user: str, mode: int, well: bool
) -> None:
    made.write("/etc/passwd", f"{user}:x:{os.geteuid()}:1::/:/bin/false\n")
    made.write("/etc/rmf-bridges/lift.yaml", mode=mode)
    made.machine = replace(made.machine, root_uid=os.geteuid() + 1)
    wrong = ("wrong", "/etc/rmf-bridges/lift.yaml does not belong to root")
    assert (wrong not in found(made, points.FILES)) == well


@pytest.mark.parametrize(
    ("user", "wanted"),
    [(user_of("lift"), "ok"), ("rmf-bridge", "warning"), ("root", "wrong"), ("", "wrong")],
)
def test_a_daemon_needs_a_user_of_its_own(made: MadeUp, user: str, wanted: str) -> None:
    made.command("systemctl", f"User={user}\nEnvironment=\nLoadState=loaded\n")
    assert levels(made, points.USERS)[0] == wanted


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ("no no no", "ok"),
        ("yes no no", "warning"),
        ("no yes no", "warning"),
        ("no no yes", "warning"),
        ("no no without-password", "warning"),
        ("no no", "unknown"),
    ],
)
def test_people_log_in_with_keys(made: MadeUp, said: str, wanted: str) -> None:
    settings = zip(points.LOGINS, said.split(), strict=False)
    made.command("sshd", "".join(f"{key} {value}\n" for key, value in settings))
    assert levels(made, points.USERS)[1] == wanted


def test_an_sshd_that_does_not_say_its_settings_is_unknown(made: MadeUp) -> None:
    made.write("/usr/sbin/sshd", "#!/bin/sh\nexit 1\n", 0o755)
    assert levels(made, points.USERS)[1] == "unknown"


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ('APT::Periodic::Unattended-Upgrade "1";\n', "ok"),
        ('APT::Periodic::Unattended-Upgrade "0";\n', "warning"),
        ("", "warning"),
    ],
)
def test_security_updates_are_installed_by_themselves(made: MadeUp, said: str, wanted: str) -> None:
    made.command("apt-config", said)
    assert levels(made, points.UPDATES) == [wanted]


def test_the_command_prints_each_point_and_ends_with_1_for_what_is_unknown(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code = cli.main(["doctor", str(ROOT / "config/lift_gateway.yaml"), "--hardening"])
    told = capsys.readouterr().out
    assert code in (1, 2)
    assert [line for line in told.splitlines() if not line.startswith(" ")] == list(SUBJECTS)

import importlib.util
import logging
import re
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Literal

import msgspec
import pytest

from bridges.kinds.shared.rmf_section import Rmf, Zenoh
from bridges.messages.definitions import PACKAGES
from bridges.settings.load import Problem, SettingsError, load
from bridges.transports.choose import domain_id, open_transport, stays_on_loopback
from bridges.transports.transport import TransportError
from tests.transports.conftest import DDS, ROS2
from tests.transports.domains import domain_of_this_run


@pytest.mark.parametrize(
    ("configured", "environ", "expected"),
    [
        (7, {"ROS_DOMAIN_ID": "3"}, 7),
        (0, {"ROS_DOMAIN_ID": "3"}, 0),
        (None, {"ROS_DOMAIN_ID": "3"}, 3),
        (None, {"ROS_DOMAIN_ID": ""}, 0),
        (None, {}, 0),
    ],
)
def test_the_yaml_names_the_domain_else_ros_does(
    configured: int | None, environ: dict[str, str], expected: int
) -> None:
    assert domain_id(Rmf(domain_id=configured), environ) == expected


@pytest.mark.parametrize("text", ["233", "-1", "1.0", "two", "²", "0x10"])
def test_an_impossible_domain_is_refused_by_name(text: str) -> None:
    with pytest.raises(TransportError, match=r"ROS_DOMAIN_ID is '.+': give a whole number"):
        domain_id(Rmf(), {"ROS_DOMAIN_ID": text})


@pytest.mark.parametrize(
    ("network", "environ", "expected"),
    [
        ("subnet", {}, False),
        ("localhost", {}, True),
        ("localhost", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, True),
        ("subnet", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, False),
        ("subnet", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, False),
        ("subnet", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, True),
        ("subnet", {"ROS_LOCALHOST_ONLY": "1"}, True),
        ("subnet", {"ROS_LOCALHOST_ONLY": "0"}, False),
        ("subnet", {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, True),
        ("subnet", {"ROS_LOCALHOST_ONLY": "0", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, True),
    ],
)
def test_the_network_is_the_narrower_of_yaml_and_ros(
    network: str, environ: dict[str, str], expected: bool
) -> None:
    rmf = msgspec.convert({"network": network}, Rmf)
    assert stays_on_loopback(rmf, environ, []) is expected


@pytest.mark.parametrize(
    ("environ", "expected"),
    [
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, False),
        ({"ROS_LOCALHOST_ONLY": "1"}, True),
    ],
)
def test_localhost_with_static_peers_reaches_them_as_in_ros(
    environ: dict[str, str], expected: bool
) -> None:
    assert stays_on_loopback(Rmf(), environ, ["10.0.0.5"]) is expected
    assert stays_on_loopback(Rmf(network="localhost"), environ, ["10.0.0.5"])


@pytest.mark.parametrize("text", ["OFF", "localhost", "WORLD"])
def test_a_range_in_which_nobody_is_found_is_refused(text: str) -> None:
    with pytest.raises(TransportError, match="use SUBNET or LOCALHOST"):
        stays_on_loopback(Rmf(), {"ROS_AUTOMATIC_DISCOVERY_RANGE": text}, [])


@pytest.fixture
def no_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the test run as on a machine without ROS."""
    monkeypatch.setitem(sys.modules, "rclpy", None)


@pytest.fixture
def bare_rclpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the test run as on a machine that has rclpy but not RMF's packages."""
    for package in set(PACKAGES.values()) | {"rclpy"}:
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
    found = ModuleSpec("found", None)
    lacking = {"rmf_charger_msgs": None}
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: lacking.get(name, found))


def test_without_ros_the_error_says_how_to_get_it(no_ros: None) -> None:
    with pytest.raises(TransportError) as refused:
        open_transport(Rmf(transport="ros2"), "node", localhost=True)
    text = str(refused.value)
    assert text.startswith(
        "transport ros2 needs ROS 2 with RMF's messages, and rclpy does not import: "
    )
    assert "sudo apt install ros-jazzy-rclpy ros-jazzy-builtin-interfaces" in text
    assert "`transport: dds` reaches the same nodes without ROS" in text


def test_without_rmfs_packages_the_error_names_the_one_that_is_missing(bare_rclpy: None) -> None:
    with pytest.raises(TransportError, match="the ROS package rmf_charger_msgs is not installed"):
        open_transport(Rmf(transport="ros2"), "node", localhost=True)


@pytest.mark.parametrize("transport", ["auto", DDS, "zenoh"])
def test_ros_args_are_accepted_by_ros2_only(
    no_ros: None, transport: Literal["auto", "dds", "zenoh"]
) -> None:
    rmf = Rmf(transport=transport, domain_id=domain_of_this_run())
    with pytest.raises(
        TransportError, match="--ros-args -r a:=b: only transport ros2 understands this"
    ):
        open_transport(rmf, "node", localhost=True, ros_args=["--ros-args", "-r", "a:=b"])
    open_transport(rmf, "node", localhost=True, ros_args=["--ros-args"]).close()


@pytest.mark.parametrize("transport", [DDS, "zenoh", ROS2])
def test_a_node_name_has_only_the_characters_that_ros_knows(
    transport: Literal["dds", "zenoh", "ros2"],
) -> None:
    rmf = Rmf(transport=transport, domain_id=domain_of_this_run())
    node = open_transport(rmf, "rmf_bridge_lift-a.ü", localhost=True)
    node.close()
    assert node.name == "rmf_bridge_lift_a__"


@pytest.mark.ros
def test_auto_opens_ros2_where_all_of_it_is_here_and_says_why(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    domain = domain_of_this_run()
    node = open_transport(Rmf(domain_id=domain), "chosen", localhost=True)
    node.close()
    assert type(node).__name__ == "Ros2Transport"
    assert caplog.messages == [
        f"transport speaks=ros2 domain_id={domain} network=localhost"
        ' reason="rclpy and RMF\'s messages are installed"'
    ]


def test_without_cyclonedds_the_error_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds", None)  # as if cyclonedds were not installed
    monkeypatch.delitem(sys.modules, "cyclonedds.core", raising=False)
    with pytest.raises(TransportError, match="write `transport: zenoh` with `keys: ros2dds`, or"):
        open_transport(Rmf(transport="dds"), "node", localhost=True)


@pytest.mark.dds
def test_auto_opens_dds_without_ros_and_says_why(
    no_ros: None, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    domain = domain_of_this_run()
    node = open_transport(Rmf(domain_id=domain), "chosen", localhost=True)
    node.close()
    assert type(node).__name__ == "DdsTransport"
    assert [text.split(" reason=")[0] for text in caplog.messages] == [
        f"transport speaks=dds domain_id={domain} network=localhost"
    ]
    assert 'reason="rclpy does not import: ' in caplog.text


def test_auto_opens_zenoh_where_neither_ros_nor_cyclonedds_is_and_says_why(
    no_ros: None, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds", None)  # as on arm64, which lacks cyclonedds
    monkeypatch.delitem(sys.modules, "cyclonedds.core", raising=False)
    caplog.set_level(logging.INFO)
    domain = domain_of_this_run()
    node = open_transport(Rmf(domain_id=domain), "chosen", localhost=True)
    node.close()
    assert type(node).__name__ == "ZenohTransport"
    assert [text.split(" reason=")[0] for text in caplog.messages] == [
        f"transport speaks=zenoh domain_id={domain} network=localhost"
    ]
    assert "; cyclonedds does not import: " in caplog.text


def test_the_yamls_zenoh_section_reaches_the_transport(tmp_path: Path) -> None:
    zenoh = Zenoh(user="lift", password_file=str(tmp_path / "none"))
    with pytest.raises(TransportError, match=r"password_file .*none cannot be read"):
        open_transport(Rmf(transport="zenoh", zenoh=zenoh), "node")
    open_transport(Rmf(transport="zenoh", zenoh=zenoh), "node", localhost=True).close()


@pytest.mark.parametrize(
    ("zenoh", "problems"),
    [
        ("{}", []),
        ("{connect: [tcp/10.0.0.5:7447, 'tls/[::1]:7447'], tls: {ca: /ca.pem}}", []),
        ("{connect: []}", ["'connect' has 0 entries: at least 1 are needed"]),
        ("{connect: [10.0.0.5]}", ["item 1 of 'connect' is '10.0.0.5': write protocol/host:port"]),
        ("{password: x}", ["unknown key 'password'"]),
        ("{user: lift}", ["'zenoh': user and password_file go together: give both, or none"]),
        ("{tls: {}}", ["no endpoint is encrypted: write connect: [tls/host:port]"]),
        ("{listen: [tls/0.0.0.0:7447]}", ["listening with TLS needs tls: {certificate: "]),
        (
            "{connect: [tls/rmf:7447], tls: {certificate: /c.pem}}",
            ["'tls': certificate and private_key go together: give both, or none"],
        ),
    ],
)
def test_an_impossible_zenoh_setting_is_named(
    tmp_path: Path, zenoh: str, problems: list[str]
) -> None:
    shipped = (Path(__file__).parents[2] / "config" / "lift_supervisor.yaml").read_text()
    rmf = f"rmf: {{transport: zenoh, zenoh: {zenoh}}}\n"
    file = tmp_path / "site.yaml"
    file.write_text(re.sub(r"^rmf:.*\n(?: .*\n)*", rmf, shipped, flags=re.MULTILINE))
    found = [problem.text for problem in problems_of(file)]
    assert len(found) == len(problems)
    for text, start in zip(found, problems, strict=True):
        assert text.startswith(start)


def problems_of(file: Path) -> tuple[Problem, ...]:
    """Return the problems of a file."""
    try:
        load(file)
    except SettingsError as error:
        return error.problems
    return ()


@pytest.mark.parametrize("speaks", [DDS, "zenoh"])
def test_simulation_stays_on_loopback_whatever_the_yaml_and_the_environment_say(
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    speaks: Literal["dds", "zenoh"],
) -> None:
    caplog.set_level(logging.INFO)
    monkeypatch.setenv("CYCLONEDDS_URI", "<no configuration at all/>")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    rmf = Rmf(transport=speaks, domain_id=domain_of_this_run(), network="subnet")
    open_transport(rmf, "simulated", localhost=True).close()
    assert "network=localhost reason=configured" in caplog.text

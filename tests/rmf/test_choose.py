import logging
import sys

import msgspec
import pytest

from bridges.fields import Rmf
from bridges.rmf.choose import domain_id, open_transport, stays_on_loopback
from bridges.rmf.dds import DdsTransport
from bridges.rmf.transport import TransportError
from tests.rmf.domains import domain_of_this_run


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
def test_a_domain_that_cannot_be_is_refused_by_name(text: str) -> None:
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
    assert stays_on_loopback(rmf, environ) is expected


@pytest.mark.parametrize("text", ["OFF", "localhost", "WORLD"])
def test_a_range_in_which_nobody_is_found_is_refused(text: str) -> None:
    with pytest.raises(TransportError, match="Use SUBNET or LOCALHOST"):
        stays_on_loopback(Rmf(), {"ROS_AUTOMATIC_DISCOVERY_RANGE": text})


def test_ros2_is_not_in_this_version_and_the_error_says_what_is() -> None:
    with pytest.raises(TransportError, match="`transport: dds`, which needs no ROS"):
        open_transport(Rmf(transport="ros2"), "node", localhost=True)


def test_without_cyclonedds_the_error_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds", None)  # as if it could not be found
    with pytest.raises(TransportError, match="pip install --no-binary cyclonedds"):
        open_transport(Rmf(transport="dds"), "node", localhost=True)


def test_auto_opens_dds_and_says_why(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    domain = domain_of_this_run()
    node = open_transport(Rmf(domain_id=domain), "chosen", localhost=True)
    node.close()
    assert isinstance(node, DdsTransport)
    assert [text.split(" reason=")[0] for text in caplog.messages] == [
        f"transport speaks=dds domain_id={domain} network=localhost"
    ]
    assert "rclpy is " in caplog.text


def test_simulation_stays_on_loopback_whatever_the_yaml_and_the_environment_say(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    monkeypatch.setenv("CYCLONEDDS_URI", "<no configuration at all/>")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    rmf = Rmf(transport="dds", domain_id=domain_of_this_run(), network="subnet")
    open_transport(rmf, "simulated", localhost=True).close()
    assert "network=localhost reason=configured" in caplog.text

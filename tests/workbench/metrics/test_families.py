"""Metrics about RMF's ROS graph and about this machine, in the form that Prometheus reads."""

from collections.abc import Iterable
from pathlib import Path

import pytest
from msgspec.structs import replace
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import Metric
from prometheus_client.parser import text_string_to_metric_families
from prometheus_client.registry import Collector

from bridges.messages import definitions as d
from bridges.messages.words import KINDS, Kind
from bridges.observe.requesters import Moment
from bridges.runtime.daemons import DaemonStatus
from bridges.system.certificates import CertificateEnd
from tests.observe.story import CHARGER, LIFT, OPEN, RED, WALL, Story
from workbench.metrics.families import LONGEST, of_graph
from workbench.metrics.machine import of_certificates, of_machine, of_recordings


class Once(Collector):
    """A collector that returns the given metric families."""

    def __init__(self, families: Iterable[Metric]) -> None:
        self._families = [*families]

    def collect(self) -> Iterable[Metric]:
        return self._families


def samples(families: Iterable[Metric]) -> dict[str, float]:
    """Return the value of each sample in a scrape, by its name `name{label="value",…}`."""
    registry = CollectorRegistry()
    registry.register(Once(families))
    text = generate_latest(registry).decode()
    found = [one for family in text_string_to_metric_families(text) for one in family.samples]
    names = [
        one.name + "{" + ",".join(f'{key}="{one.labels[key]}"' for key in sorted(one.labels)) + "}"
        for one in found
    ]
    assert len(set(names)) == len(names)
    return dict(zip(names, (one.value for one in found), strict=True))


def scraped(story: Story) -> dict[str, float]:
    now = Moment(story.now, WALL + story.now)
    return samples(of_graph(story.graph, story.tally, now))


LIFT1 = '{device="Lift1",kind="lift"}'


def test_a_silent_lift_is_down_and_its_reading_ages() -> None:
    story = Story().lift().passes(1).lift()
    found = scraped(story)
    up, age = f"rmf_bridge_device_up{LIFT1}", f"rmf_bridge_device_reading_age_seconds{LIFT1}"
    assert (found[up], found[age]) == (1.0, 0.0)
    found = scraped(story.passes(10))
    assert (found[up], found[age]) == (0.0, 10.0)


def test_exactly_one_mode_is_present() -> None:
    shown = replace(LIFT, current_mode=d.LiftMode.MODE_FIRE)
    found = scraped(Story().hear("lift_states", shown))
    modes = {name: value for name, value in found.items() if "device_mode" in name}
    assert len(modes) == len(d.LiftMode)
    assert [name for name, value in modes.items() if value] == [
        'rmf_bridge_device_mode{device="Lift1",kind="lift",mode="fire"}'
    ]


def test_a_waiting_robot_and_a_still_car_with_a_robot_show_their_seconds() -> None:
    story = Story().lift().passes(10).asks(RED).passes(2).asks(RED).lift()
    assert scraped(story)[f"rmf_bridge_device_waiting_seconds{LIFT1}"] == 2.0
    story.lift(RED, "L2", OPEN)
    for _ in range(200):
        story.passes(1).asks(RED).lift(RED, "L2", OPEN)
    found = scraped(story)
    assert found['rmf_bridge_lift_session_still_seconds{device="Lift1"}'] == 200.0
    assert found[f"rmf_bridge_device_held{LIFT1}"] == 1.0
    assert found['rmf_bridge_wait_seconds_bucket{device="Lift1",kind="lift",le="2.0"}'] == 1.0


WORKCELLS: dict[str, type[d.DispenserState | d.IngestorState]] = {
    "dispenser": d.DispenserState,
    "ingestor": d.IngestorState,
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_device_of_each_kind_has_its_modes_with_exactly_one_present(kind: Kind) -> None:
    story = Story()
    if kind in WORKCELLS:
        story.hear(f"{kind}_states", WORKCELLS[kind](guid="X", mode=1, request_guid_queue=("1",)))
    else:
        {"lift": story.lift, "door": lambda: story.door(OPEN)}.get(
            kind, lambda: story.hear("charger_states", CHARGER)
        )()
    found = scraped(story)
    assert sum(value for name, value in found.items() if "device_mode" in name) == 1.0


def test_the_faults_of_panels_robots_and_daemons_are_series_of_their_own() -> None:
    said = [
        _status("node: Main panel", "alarm", "Main panel", "ALARM_RAISED"),
        _status("fleet: AMR1", "fleet", "AMR1", "ROBOT_SILENT"),
        _status("node: daemon", "lift", "node", "NOT_KEPT"),
    ]
    found = scraped(Story().hear("/diagnostics", d.DiagnosticArray(status=tuple(said))))
    assert {name for name in found if "device_fault" in name} == {
        'rmf_bridge_device_fault{code="ALARM_RAISED",device="Main panel",kind="alarm"}',
        'rmf_bridge_device_fault{code="ROBOT_SILENT",device="AMR1",kind="fleet"}',
        'rmf_bridge_device_fault{code="NOT_KEPT",device="node",kind="daemon"}',
    }


def _status(name: str, kind: str, subject: str, code: str) -> d.DiagnosticStatus:
    values = (d.KeyValue("kind", kind), d.KeyValue(code, "since 3 s"))
    return d.DiagnosticStatus(2, name, code, subject, values)


def test_faults_and_refusals_of_the_daemon_are_series_and_end_with_its_silence() -> None:
    pairs = (("kind", "lift"), ("FIRE", "the alarm"), ("refused unknown floor", "3"))
    values = tuple(d.KeyValue(*pair) for pair in pairs)
    said = d.DiagnosticStatus(2, "node: Lift1", "FIRE", "Lift1", values)
    story = Story().lift().hear("/diagnostics", d.DiagnosticArray(status=(said,)))
    fault = 'rmf_bridge_device_fault{code="FIRE",device="Lift1",kind="lift"}'
    found = scraped(story)
    assert found[fault] == 1.0
    of_node = 'device="Lift1",kind="lift",node="node",reason="unknown floor"'
    assert found[f"rmf_bridge_device_refusals_total{{{of_node}}}"] == 3.0
    assert fault not in scraped(story.passes(10))


def _reports(node: str, kind: str, **values: str) -> d.DiagnosticArray:
    """Return a node's reports on Lift1 and on itself."""
    pairs = tuple(d.KeyValue(*pair) for pair in {"kind": kind, **values}.items())
    said = [
        d.DiagnosticStatus(0, f"{node}: {about}", "NOT_KEPT", about_id, pairs)
        for about, about_id in (("Lift1", "Lift1"), ("daemon", node))
    ]
    return d.DiagnosticArray(status=tuple(said))


def test_refusals_never_decrease_when_one_of_two_nodes_starts_anew() -> None:
    story = Story().lift()
    for node, kind, count in (("a", "lift", "9"), ("s", "lift_supervisor", "5")):
        story.hear("/diagnostics", _reports(node, kind, **{"refused other session": count}))
    story.hear("/diagnostics", _reports("s", "lift_supervisor", **{"refused other session": "1"}))
    found = {name: value for name, value in scraped(story).items() if "refusals_total" in name}
    assert sorted(found.values()) == [1.0, 9.0]


def test_a_simulated_device_is_simulated_also_with_a_fault_and_until_real_hardware_serves() -> None:
    simulated = f"rmf_bridge_device_simulated{LIFT1}"
    story = Story().lift().hear("/diagnostics", _reports("sim", "lift", simulated="yes")).lift()
    assert scraped(story)[simulated] == 1.0
    assert scraped(story.passes(50))[simulated] == 1.0
    story.lift().hear("/diagnostics", _reports("real", "lift", simulated="no"))
    assert scraped(story)[simulated] == 0.0


def test_no_name_from_the_network_breaks_a_line_or_grows_without_bound() -> None:
    name = 'a"\n\\' + "x" * 1000
    found = scraped(Story().hear("lift_states", replace(LIFT, lift_name=name)))
    assert all(len(one) < 4 * LONGEST + 200 for one in found)
    assert sum("device_up" in one for one in found) == 1


def test_a_daemons_counts_come_from_its_status_and_a_dead_daemon_is_down() -> None:
    counts = {"scans": 7, "failed_scans": 2, "scan_seconds": 0.5, "switched_on": {"call": 3}}
    device = {"counts": counts, "input_age_s": 0.1, "faults": []}
    faults = [{"code": "RIVAL", "detail": ""}]
    status = {"devices": {"Lift1": device}, "faults": faults, "watchdog_slack_s": 7.9}
    serving = DaemonStatus(name="lift", state="serving", by="service", status=status, age_s=0.5)
    dead = DaemonStatus(name="door", state="left on", by="service", status=status, age_s=3600.0)
    found = samples(of_machine([serving, dead]))
    assert {name: value for name, value in found.items() if value} == {
        'rmf_bridge_daemon_up{daemon="lift"}': 1.0,
        'rmf_bridge_daemon_outputs_unverified{daemon="door"}': 1.0,
        'rmf_bridge_daemon_status_age_seconds{daemon="lift"}': 0.5,
        'rmf_bridge_daemon_status_age_seconds{daemon="door"}': 3600.0,
        'rmf_bridge_daemon_watchdog_slack_seconds{daemon="lift"}': 7.9,
        'rmf_bridge_daemon_fault{code="RIVAL",daemon="lift"}': 1.0,
        'rmf_bridge_daemon_device_scans_total{daemon="lift",device="Lift1"}': 7.0,
        'rmf_bridge_daemon_device_failed_scans_total{daemon="lift",device="Lift1"}': 2.0,
        'rmf_bridge_daemon_device_scan_seconds_total{daemon="lift",device="Lift1"}': 0.5,
        'rmf_bridge_daemon_output_switched_on_total{daemon="lift",device="Lift1",output="call"}': 3.0,
        'rmf_bridge_daemon_device_input_age_seconds{daemon="lift",device="Lift1"}': 0.1,
    }


def test_the_calls_of_each_unit_are_series_and_an_odd_status_is_none() -> None:
    silent = {"calls": 9, "failed_calls": 4, "call_seconds": 1.5, "longest_call_s": 0.3}
    status = {"buses": {"io": {"unit 1": silent, "unit 2": {"calls": "many"}}}}
    found = samples(of_machine([DaemonStatus(name="lift", state="serving", by="", status=status)]))
    unit = '{bus="io",daemon="lift",unit="unit 1"}'
    assert {name: value for name, value in found.items() if "_bus_" in name} == {
        f"rmf_bridge_daemon_bus_calls_total{unit}": 9.0,
        f"rmf_bridge_daemon_bus_failed_calls_total{unit}": 4.0,
        f"rmf_bridge_daemon_bus_call_seconds_total{unit}": 1.5,
        f"rmf_bridge_daemon_bus_longest_call_seconds{unit}": 0.3,
    }


def test_certificates_are_series_by_key_and_an_unknown_end_is_only_unreadable() -> None:
    files = {"rmf.zenoh.tls.ca": "/ca.pem", "buses.io.ca_file": "/gone.pem"}
    one = DaemonStatus(name="lift", state="died", by="", status={"certificate_files": files})
    ends = {"/ca.pem": CertificateEnd(1e9), "/page.pem": CertificateEnd(2e9)}
    gone = CertificateEnd(None, "No such file or directory")
    found = samples(of_certificates([one], ["/page.pem"], lambda file: ends.get(file, gone)))

    def labels(daemon: str, file: str, key: str) -> str:
        return f'{{daemon="{daemon}",file="{file}",key="{key}"}}'

    ca = labels("lift", "/ca.pem", "rmf.zenoh.tls.ca")
    page = labels("", "/page.pem", "--certificate")
    other = labels("lift", "/gone.pem", "buses.io.ca_file")
    assert found == {
        f"rmf_bridge_certificate_end_timestamp_seconds{ca}": 1e9,
        f"rmf_bridge_certificate_end_timestamp_seconds{page}": 2e9,
        f"rmf_bridge_certificate_unreadable{ca}": 0.0,
        f"rmf_bridge_certificate_unreadable{page}": 0.0,
        f"rmf_bridge_certificate_unreadable{other}": 1.0,
    }


def test_a_folder_of_recordings_that_cannot_be_read_is_no_series(tmp_path: Path) -> None:
    (tmp_path / "one.mcap").write_bytes(b"x" * 1000)
    assert samples(of_recordings(tmp_path))["rmf_bridge_recordings_bytes{}"] == 1000.0
    assert samples(of_recordings(tmp_path / "missing")) == {}

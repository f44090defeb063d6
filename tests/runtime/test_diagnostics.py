"""The messages on `/diagnostics` from a real daemon. One message comes each second."""

from pathlib import Path

import pytest

from bridges.messages import definitions as d
from bridges.messages.topics import DIAGNOSTICS, DOOR_STATES
from bridges.observe.diagnosis import faults
from bridges.runtime.diagnostics import MOST, diagnosis
from hal_fakes.wire import join
from tests.runtime.site import PATIENT, SERVICE, Module, daemon
from tests.waiting import wait_until

AT = d.Time(7, 8)
DAEMON = {"simulated": False, "pid": 12, "samples_dropped": {"door_requests": 3}}
LIFT = {
    "mode": "AGV",
    "faults": [{"code": "OVERLOAD", "detail": "since 3 s"}, {"code": "RMF_SILENT", "detail": ""}],
    "input_age_s": 0.012,
    "refused": {"not a floor": 2},
}


def values(**pairs: str) -> tuple[d.KeyValue, ...]:
    return tuple(d.KeyValue(key.replace("__", " "), value) for key, value in pairs.items())


def test_a_message_reports_the_daemon_and_each_device_with_its_faults_and_its_inputs_age() -> None:
    found = diagnosis("node", "lift", DAEMON, {"Lift1": LIFT}, AT)
    daemons = values(kind="lift", simulated="no", pid="12", samples_dropped__door_requests="3")
    lifts = values(
        kind="lift",
        mode="AGV",
        OVERLOAD="since 3 s",
        RMF_SILENT="",
        input_age_s="0.012",
        refused__not__a__floor="2",
    )
    assert found == d.DiagnosticArray(
        d.Header(AT),
        (
            d.DiagnosticStatus(d.DiagnosticLevel.OK, "node: daemon", "OK", "node", daemons),
            d.DiagnosticStatus(
                d.DiagnosticLevel.ERROR, "node: Lift1", "OVERLOAD, RMF_SILENT", "Lift1", lifts
            ),
        ),
    )
    assert [faults(status) for status in found.status] == [(), ("OVERLOAD", "RMF_SILENT")]


@pytest.mark.parametrize(
    ("status", "level", "message"),
    [
        ({"faults": [], "input_age_s": 0.1}, d.DiagnosticLevel.OK, "OK"),
        ({"faults": [], "input_age_s": None}, d.DiagnosticLevel.STALE, "not read yet"),
        ({}, d.DiagnosticLevel.STALE, "not read yet"),
    ],
)
def test_a_device_is_ok_only_once_it_has_been_read(
    status: dict[str, object], level: d.DiagnosticLevel, message: str
) -> None:
    device = diagnosis("node", "door", {}, {"ward": status}, AT).status[1]
    assert (device.level, device.message) == (level, message)


@pytest.mark.parametrize(
    ("status", "message"),
    [({"simulated": True}, "SIMULATED"), ({"passive": True}, "PASSIVE")],
)
def test_a_daemon_that_does_not_do_the_real_work_is_a_warning(
    status: dict[str, object], message: str
) -> None:
    (said,) = diagnosis("node", "door", status, {}, AT).status
    assert (said.level, said.message) == (d.DiagnosticLevel.WARN, message)


def test_a_flood_of_names_does_not_make_the_message_grow_without_end() -> None:
    devices = {str(number): LIFT for number in range(10 * MOST)}
    assert len(diagnosis("node", "lift", {}, devices, AT).status) == 1 + MOST


def test_a_daemon_reports_its_door_and_the_lost_module(domain: int, tmp_path: Path) -> None:
    module = Module(tmp_path, domain)
    module.file.write_text(module.yaml.replace(PATIENT, "stale_after_s: 1"))
    listener = join("listener", domain)
    heard: list[d.DiagnosticArray] = []
    listener.subscribe(DIAGNOSTICS, heard.append)
    try:
        with daemon(module.file, tmp_path / "run", **SERVICE):
            wait_until(lambda: heard and heard[-1].status[1].level == 0, "the door is well")
            module.close()
            wait_until(lambda: faults(heard[-1].status[1]), "the door's fault is named")
            assert faults(heard[-1].status[1]) == ("COMMUNICATION_LOST",)
            assert [status.name for status in heard[-1].status] == [
                "rmf_bridge_ward_door: daemon",
                "rmf_bridge_ward_door: ward_door",
            ]
    finally:
        listener.close()


def test_diagnostics_can_be_switched_off(domain: int, tmp_path: Path) -> None:
    module = Module(tmp_path, domain)
    text = module.file.read_text()
    module.file.write_text(text.replace("rmf: {", "rmf: {diagnostics: false, "))
    listener = join("listener", domain)
    states: list[d.DoorState] = []
    listener.subscribe(DOOR_STATES, states.append)
    diagnostics = listener.subscribe(DIAGNOSTICS, lambda message: None)
    try:
        with daemon(module.file, tmp_path / "run", **SERVICE):
            wait_until(lambda: len(states) > 1, "the door's states come")
            assert diagnostics.matched() == 0
    finally:
        module.close()
        listener.close()

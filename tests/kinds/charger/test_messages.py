"""The charger's daemon reads ChargerRequest and ChargerCancel, and writes ChargerState."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger import KIND, messages
from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import ChargerDurations, ChargerSettings
from bridges.kinds.charger.signals import Cancelled, ChargeRequested, Measured
from bridges.kinds.shared.decision import RequestRefused
from bridges.messages.definitions import (
    ChargerCancel,
    ChargerRequest,
    ChargerState,
    ChargerStateValue,
    Duration,
    Time,
)
from bridges.messages.topics import CHARGER_CANCELS, CHARGER_REQUESTS

SETTINGS = ChargerSettings(limits=ChargerDurations(misses=5))
RIGHT = ChargerRequest("charger_a", "tiny", "AMR01", Duration(30, 500_000_000), "coordinator-7")


def asked(**changes: object) -> object:
    request = replace(RIGHT, **changes)
    return KIND.requests[CHARGER_REQUESTS](request, SETTINGS)


def test_a_request_becomes_an_event_with_its_start_timeout_in_seconds() -> None:
    assert asked() == ChargeRequested("coordinator-7", "tiny", "AMR01", 30.5)


def test_a_cancel_becomes_an_event() -> None:
    cancel = ChargerCancel("charger_a", "coordinator-7")
    assert KIND.requests[CHARGER_CANCELS](cancel, SETTINGS) == Cancelled("coordinator-7")


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"request_id": ""}, "empty request_id"),
        ({"fleet_name": ""}, "empty fleet_name"),
        ({"robot_name": ""}, "empty robot_name"),
        ({"request_id": "x" * 257}, "impossible request_id"),
        ({"robot_name": "AMR\n01"}, "impossible robot_name"),
        ({"fleet_name": "\x1b[2J"}, "impossible fleet_name"),
        ({"request_id": "unrequested/charger_a"}, "reserved request_id"),
        ({"start_timeout": Duration(-1, 0)}, "negative start_timeout"),
        ({"start_timeout": Duration(86400, 1)}, "absurd start_timeout"),
    ],
)
def test_a_malformed_request_is_refused_by_name(changes: dict[str, object], kind: str) -> None:
    with pytest.raises(RequestRefused) as refusal:
        asked(**changes)
    assert refusal.value.kind == kind


def test_a_charge_without_a_request_is_cancelled_by_its_published_id() -> None:
    accept = KIND.requests[CHARGER_CANCELS]
    ours = ChargerCancel("charger_a", "unrequested/charger_a")
    theirs = ChargerCancel("charger_a", "unrequested/charger_b")
    assert [accept(cancel, SETTINGS) for cancel in (ours, theirs)] == [
        Cancelled(""),
        Cancelled("unrequested/charger_b"),
    ]


def test_a_cancel_without_a_request_id_is_refused_by_name() -> None:
    with pytest.raises(RequestRefused) as refusal:
        KIND.requests[CHARGER_CANCELS](ChargerCancel("charger_a", ""), SETTINGS)
    assert refusal.value.kind == "empty request_id"


def test_a_name_of_256_letters_of_any_script_is_taken() -> None:
    assert asked(robot_name="充" * 256) == ChargeRequested(
        "coordinator-7", "tiny", "充" * 256, 30.5
    )


def test_a_charging_station_is_reported_in_the_form_that_rmf_reads() -> None:
    shown = ChargerReport(
        read_at=1.0,
        state=ChargerStateValue.CHARGER_CHARGING,
        request_id="r1",
        fleet="tiny",
        robot="AMR01",
        measured=Measured(time_to_full_s=90.5),
    )
    assert messages.state_message("charger_a", SETTINGS, shown, Time(5, 6)) == ChargerState(
        charger_time=Time(5, 6),
        state=3,
        charger_name="charger_a",
        error_message="",
        request_id="r1",
        robot_fleet="tiny",
        robot_name="AMR01",
        time_to_fully_charged=Duration(90, 500_000_000),
    )


@pytest.mark.parametrize("state", ChargerStateValue)
def test_every_state_except_idle_has_a_request_id_even_without_a_request(
    state: ChargerStateValue,
) -> None:
    message = messages.state_message("charger_a", SETTINGS, ChargerReport(1.0, state), Time())
    free = state is ChargerStateValue.CHARGER_IDLE
    assert message == ChargerState(
        state=int(state),
        charger_name="charger_a",
        request_id="" if free else "unrequested/charger_a",
    )


def test_the_kind_finds_the_charger_in_each_of_its_messages() -> None:
    named = [RIGHT, ChargerCancel("charger_b", "x"), ChargerState(charger_name="charger_c")]
    assert [KIND.device_name(m) for m in named] == ["charger_a", "charger_b", "charger_c"]


def test_the_limits_are_those_of_the_settings() -> None:
    assert KIND.limits(SETTINGS, {}) == ChargerLimits(ChargerDurations(misses=5))


def test_the_summary_says_that_a_robot_is_not_verified() -> None:
    idle = ChargerReport(1.0, ChargerStateValue.CHARGER_IDLE)
    lost = ChargerReport(
        None, ChargerStateValue.CHARGER_ERROR, "Charger unreachable", "r1", "tiny", "AMR01"
    )
    seen = ChargerReport(
        1.0,
        ChargerStateValue.CHARGER_CHARGING,
        "",
        "r1",
        "tiny",
        "AMR01",
        verified=True,
        measured=Measured(
            receiver_id="17",
            at_height=True,
            range_ok=False,
            volts=48.25,
            temperatures=(("coil", 41),),
        ),
    )
    assert [KIND.summary(report) for report in (idle, lost, seen)] == [
        {"state": "IDLE", "request": "-", "robot": "-", "error": "-"},
        {
            "state": "ERROR",
            "request": "r1",
            "robot": "tiny/AMR01 (unverified)",
            "error": "Charger unreachable",
        },
        {
            "state": "CHARGING",
            "request": "r1",
            "robot": "tiny/AMR01",
            "error": "-",
            "receiver": "17",
            "range_ok": "no",
            "at_height": "yes",
            "volts": "48.25",
            "coil_celsius": "41",
        },
    ]

"""CHARGER-4, CHARGER-6, CHARGER-7, CHARGER-8: a station that fails, is lost or restarts."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.core import CLEARED_WITHIN_S
from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import ChargerDurations
from bridges.kinds.charger.signals import Activity as A
from bridges.kinds.charger.signals import (
    ChargerOutputs,
    ChargerSample,
    Measured,
)
from bridges.kinds.shared.decision import Fault, Sampled, WriteFailed
from bridges.messages.definitions import ChargerStateValue as State
from tests.kinds.charger.station import NOBODY, ONE, SERVING, TWO, docked, story
from tests.kinds.charger.story import (
    AMR1,
    AMR2,
    CANCEL_1,
    DURATIONS,
    FULL,
    RECEIVERS,
    RESET,
    SILENT,
    Story,
)

# ---- CHARGER-6: failures of the station or of the robot


def at_fault(text: str, side: str = "", receiver: str = ONE) -> Sampled[ChargerSample]:
    measured = Measured(receiver_id=receiver)
    return Sampled(ChargerSample(A.ERROR, 238, text, measured, side))  # type: ignore[arg-type]


@pytest.mark.parametrize("side", ["station", ""])
def test_a_station_at_fault_is_out_of_service_until_a_clearing_has_helped(
    side: str,
) -> None:
    it = docked().event(at_fault("over temperature", side))
    text = f"{side}: over temperature" if side else "over temperature"
    assert it.outputs == ChargerOutputs(power=False)
    assert it.told[-1] == (5.0, "ERROR", text)
    it.sees((A.IDLE, ONE, 3600), (A.IDLE, NOBODY, 3600)).event(AMR2)
    assert it.told[4:] == [(5.0, "ERROR", f"out of service after: {text}")]
    assert it.refused == [(7205.0, "charger in error")]
    it.event(RESET)
    assert it.outputs == ChargerOutputs(power=False, clear_errors=1)
    assert it.told[-1][1] == "ERROR"
    it.sees((A.IDLE, NOBODY, 1)).event(AMR2)
    assert it.told[-2:] == [(7205.0, "IDLE", ""), (7206.0, "ASSIGNED", "req-2")]


def test_a_fault_on_the_side_of_the_robot_leaves_the_station_in_service() -> None:
    it = (
        story()
        .event(AMR1)
        .sees((A.HANDSHAKE, ONE, 2))
        .event(at_fault("handshake timeout", "robot"))
    )
    assert it.told[-1] == (3.0, "ERROR", "robot: handshake timeout")
    it.sees((A.IDLE, ONE, 3), (A.IDLE, NOBODY, 1))
    assert it.told[3:] == [(3.0, "RELEASED", "req-1"), (6.0, "IDLE", "")]
    assert it.event(AMR2).told[-1] == (7.0, "ASSIGNED", "req-2")


def test_a_waiting_request_survives_the_fault_of_a_wrong_robot_but_not_of_the_station() -> None:
    theirs = story().event(AMR1).event(at_fault("handshake timeout", "robot", TWO))
    theirs.sees((A.IDLE, NOBODY, 1))
    assert theirs.told[-1] == (1.0, "ASSIGNED", "req-1")
    ours = story().event(AMR1).event(at_fault("fan stuck", "station", TWO)).event(RESET)
    ours.sees((A.IDLE, NOBODY, 3))
    assert ours.told[-2:] == [(1.0, "RELEASED", "req-1"), (3.0, "IDLE", "")]


def test_the_text_names_the_side_at_fault_once() -> None:
    it = story().event(at_fault("station: fan stuck", "station"))
    assert it.told[-1] == (1.0, "ERROR", "station: fan stuck")
    assert it.faults == [
        "CHARGER_ERROR: station: fan stuck",
        "PROTECTION: out of service after: station: fan stuck",
        "WRONG_DOCKING: wrong docking: tiny/AMR01 is not assigned here",
    ]


def test_one_clearing_puts_a_station_back_into_service_once() -> None:
    it = story().event(at_fault("fan stuck")).event(RESET).sees((A.IDLE, NOBODY, 5))
    assert (it.told[-1], it.refused) == ((1.0, "IDLE", ""), [])
    it.event(at_fault("fan stuck")).sees((A.IDLE, NOBODY, 5))
    assert it.told[-1] == (6.0, "ERROR", "out of service after: fan stuck")


def test_a_clearing_that_failed_does_not_count_later() -> None:
    it = docked().event(at_fault("fan stuck", "station")).event(RESET)
    for _ in range(40):
        it.event(at_fault("fan stuck", "station"))
        it.now += 1.0
    it.sees((A.IDLE, NOBODY, 100))
    assert it.told[-1] == (45.0, "ERROR", "out of service after: station: fan stuck")


def test_a_good_reading_proves_a_clearing_until_the_end_of_its_time() -> None:
    def shown_after(later_s: float) -> str:
        it = story().event(Sampled(ChargerSample(A.ERROR, 9, "fan", side="station"))).event(RESET)
        it.now += later_s
        it.sees((A.IDLE, NOBODY, 1))
        return it.told[-1][1]

    assert shown_after(CLEARED_WITHIN_S) == "IDLE"
    assert shown_after(CLEARED_WITHIN_S + 0.001) == "ERROR"


def test_a_clearing_that_was_written_counts_although_a_later_command_fails() -> None:
    it = story().event(at_fault("fan stuck", "station")).event(RESET)
    it.event(at_fault("fan stuck", "station")).now += 1.0
    it.event(at_fault("fan stuck", "station")).event(WriteFailed("timeout"))
    it.sees((A.IDLE, NOBODY, 1))
    assert it.memory.protection == ""


def test_a_station_that_charges_or_is_unknown_proves_no_clearing() -> None:
    it = docked().event(at_fault("fan stuck")).sees((A.CHARGING, ONE, 1)).event(RESET)
    it.sees((A.CHARGING, ONE, 1), (A.STOPPING, ONE, 1), (A.UNKNOWN, ONE, 1))
    assert it.memory.protection == "fan stuck"
    it.sees((A.RELEASED, ONE, 1))
    assert it.memory.protection == ""


def test_a_fault_of_the_station_ends_the_request_which_can_then_be_cancelled() -> None:
    it = docked().event(at_fault("fan stuck")).event(CANCEL_1)
    it.sees((A.IDLE, NOBODY, 4))
    assert it.report is not None
    assert (it.report.state, it.report.request_id) == (State.CHARGER_ERROR, "")
    assert it.refused == []


def test_a_station_that_goes_on_charging_when_told_to_stop_is_out_of_service() -> None:
    it = docked().event(CANCEL_1).sees((A.CHARGING, ONE, 40))
    assert it.told[3:] == [
        (
            35.0,
            "ERROR",
            "out of service after: station: it goes on charging after an order to stop; cut its"
            " supply",
        )
    ]
    assert it.outputs.power is False
    slow = (
        docked()
        .event(CANCEL_1)
        .sees((A.CHARGING, ONE, 29), (A.STOPPING, ONE, 60), (A.IDLE, ONE, 1))
    )
    assert slow.memory.protection == ""


def test_repeated_failures_of_commands_are_an_error() -> None:
    it = docked().event(CANCEL_1)
    for _ in range(3):
        it.sees((A.CHARGING, ONE, 1)).event(WriteFailed("status 500"))
    assert it.told[-1] == (8.0, "ERROR", "Charger takes no commands")
    assert it.faults[-1] == "CHARGER_NOT_COMMANDED: status 500"
    assert it.refused == []
    it.sees((A.CHARGING, ONE, 1))
    assert it.told[-1] == (8.0, "ERROR", "Charger takes no commands")
    it.sees((A.STOPPING, ONE, 1))
    assert it.told[-1] == (9.0, "CHARGING", "req-1")


def test_a_station_that_obeys_after_an_outage_stays_in_service() -> None:
    it = docked().event(CANCEL_1).event(WriteFailed("timeout"))
    it.sees((A.CHARGING, ONE, 1)).event(WriteFailed("timeout")).polls("silent 40")
    it.sees((A.CHARGING, ONE, 1), (A.STOPPING, ONE, 1), (A.IDLE, NOBODY, 3))
    assert (it.told[-1][1], it.memory.protection) == ("IDLE", "")


def test_after_three_failed_commands_the_stop_has_its_whole_time_again() -> None:
    it = docked().event(CANCEL_1).sees((A.CHARGING, ONE, 20)).all([WriteFailed("status 500")] * 3)
    it.sees((A.CHARGING, ONE, 31))
    assert it.memory.protection == ""
    assert it.sees((A.CHARGING, ONE, 1)).memory.protection != ""


def test_after_an_outage_the_stop_has_its_whole_time_again() -> None:
    it = docked().event(CANCEL_1).sees((A.CHARGING, ONE, 20)).polls("silent 3")
    it.sees((A.CHARGING, ONE, 30))
    assert it.memory.protection == ""
    it.sees((A.CHARGING, ONE, 2))
    assert it.memory.protection != ""


@pytest.mark.parametrize("asked", [True, False])
def test_a_station_whose_stop_was_never_written_stays_in_service(asked: bool) -> None:
    it = docked().event(CANCEL_1) if asked else story()
    for _ in range(60):
        it.sees((A.CHARGING, ONE, 1)).event(WriteFailed("status 500"))
    it.sees((A.CHARGING, ONE, 1), (A.IDLE, NOBODY, 3))
    assert (it.told[-1][1], it.memory.protection) == ("IDLE", "")


def test_the_stop_has_its_whole_time_from_the_first_order_that_was_written() -> None:
    it = docked().event(CANCEL_1).event(WriteFailed("status 500"))
    it.sees((A.CHARGING, ONE, 31))
    assert it.memory.protection == ""
    assert it.sees((A.CHARGING, ONE, 1)).memory.protection != ""


def test_single_failures_do_not_keep_a_disobedient_station_in_service() -> None:
    it = docked().event(CANCEL_1)
    for _ in range(10):
        it.sees((A.CHARGING, ONE, 1)).event(WriteFailed("status 500"))
        it.polls("silent 1").sees((A.CHARGING, ONE, 2))
    assert it.memory.protection != ""


# ---- CHARGER-4, CHARGER-7: cancel and unreachable


def test_a_cancel_for_a_lost_station_ends_the_power_as_soon_as_the_station_answers() -> None:
    it = docked().all([SILENT] * 3).event(CANCEL_1)
    assert it.outputs == ChargerOutputs(power=False)


def test_a_reset_frees_a_lost_station_only_after_its_own_switch_off_time() -> None:
    limits = replace(FULL, t=ChargerDurations(peer_internal_timeout_s=15.0))
    it = story(limits).event(AMR1).sees((A.CHARGING, ONE, 1)).all([SILENT] * 3)
    it.now = 15.9
    it.event(RESET)
    it.now = 16.0
    it.event(RESET)
    assert it.refused == [(15.9, "the charger does not answer")]
    assert it.report is not None
    assert (it.report.state, it.report.request_id) == (State.CHARGER_ERROR, "")
    never = story().event(AMR1).sees((A.CHARGING, ONE, 1)).all([SILENT] * 3)
    never.now = 1e6
    assert never.event(RESET).refused == [(1e6, "the charger does not answer")]


def test_a_request_after_a_failed_poll_gets_no_power_before_a_good_reading() -> None:
    it = story().sees((A.IDLE, ONE, 1)).event(SILENT).event(AMR1)
    assert it.outputs.power is False
    assert it.event(SILENT).outputs.power is False
    assert it.sees((A.IDLE, ONE, 1)).outputs.power is True
    assert it.event(SILENT).outputs.power is True


def test_a_request_after_a_failed_poll_takes_over_an_adopted_charge() -> None:
    it = Story(FULL).sees((A.CHARGING, ONE, 1)).event(SILENT).event(AMR1)
    assert it.outputs.power is True


# ---- CHARGER-8: restart


def test_a_restart_during_a_charge_adopts_charge_and_robot_and_keeps_the_power() -> None:
    it = Story(FULL).sees((A.CHARGING, ONE, 2))
    assert it.powered == [None, None]
    assert it.report == ChargerReport(
        read_at=1.0,
        state=State.CHARGER_CHARGING,
        fleet="tiny",
        robot="AMR01",
        verified=True,
        faults=(Fault("UNREQUESTED_CHARGING", "nobody requested it: tiny/AMR01"),),
        measured=Measured(receiver_id=ONE),
    )
    it.event(AMR2).event(AMR1).sees((A.CHARGING, ONE, 1))
    assert it.refused == [(2.0, "charger occupied")]
    assert it.powered == [None, None, True]
    assert it.told[-1] == (2.0, "CHARGING", "req-1")


def test_a_restart_during_the_charge_of_a_stranger_ends_the_charge() -> None:
    it = Story(FULL).sees((A.CHARGING, "4711", 1))
    assert (it.powered, it.told) == ([False], [(0.0, "ERROR", "unknown receiver 4711")])


def test_a_charge_that_begins_without_a_request_is_stopped() -> None:
    it = story().sees((A.CHARGING, ONE, 1))
    assert it.powered == [False, False]
    unseen = Story(ChargerLimits(DURATIONS)).polls("idle 1, charging 1")
    assert unseen.outputs.power is False


def test_a_station_that_serves_known_robots_stops_a_charge_into_an_empty_pad() -> None:
    it = story(SERVING).sees((A.CHARGING, NOBODY, 2))
    assert it.powered == [False, False, False]
    left = story(SERVING).sees((A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1), (A.CHARGING, NOBODY, 2))
    assert left.powered == [False, True, True, True, True]  # no receiver is told during the charge
    left.sees((A.IDLE, NOBODY, 4), (A.CHARGING, NOBODY, 1))
    assert left.powered[5:] == [False] * 5


def test_a_charge_that_began_at_a_lost_station_is_adopted() -> None:
    it = story().all([SILENT] * 3).sees((A.CHARGING, ONE, 1))
    assert it.powered[-1] is None


def test_an_adopted_charge_goes_on_for_any_reading_of_its_range() -> None:
    asked = Story(FULL).sees((A.CHARGING, ONE, 1), in_range=False).event(AMR1)
    assert (asked.outputs.power, asked.memory.adopted) == (True, False)
    serves = replace(FULL, unrequested="serve_known")
    served = Story(serves).sees((A.CHARGING, ONE, 1), in_range=False)
    assert (served.outputs.power, served.memory.adopted) == (True, False)


def test_a_lost_station_shows_only_the_robot_that_it_charged_last() -> None:
    adopted = Story(FULL).sees((A.CHARGING, ONE, 1))
    refused = story().sees((A.IDLE, ONE, 1))
    for it, robot in ((docked(), "AMR01"), (adopted, "AMR01"), (refused, "")):
        it.all([SILENT] * 3)
        assert it.report is not None
        assert (it.report.robot, it.report.verified) == (robot, False)


def test_each_receiver_belongs_to_the_robot_that_the_yaml_names() -> None:
    assert {receiver: str(robot) for receiver, robot in RECEIVERS.items()} == {
        "rx-1": "tiny/AMR01",
        "rx-2": "tiny/AMR02",
    }


def test_another_receiver_causes_a_message_and_another_age_does_not() -> None:
    report = story().event(AMR1).sees((A.HANDSHAKE, ONE, 1)).report
    assert report is not None
    assert replace(report, read_at=99.0).news() == report.news()
    assert replace(report, measured=Measured(receiver_id=TWO)).news() != report.news()
    assert replace(report, measured=Measured(receiver_id=ONE, volts=48.0)).news() == report.news()

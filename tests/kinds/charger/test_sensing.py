"""A station on contacts that bounce. The stories run in virtual time, with the shipped driver's decoder
and its default debounce."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.settings import ChargerDurations
from bridges.kinds.shared.debounce import RESTLESS_S
from bridges.kinds.shared.decision import RivalSeen, Sampled
from bridges.settings.load import load
from drivers.charger.dry_contact import debounce, decode
from tests.kinds.charger.story import AMR1, AMR2, RESET, SILENT, Story

SETTINGS = load(Path(__file__).parents[3] / "config" / "charger_contacts.yaml").devices["charger_e"]
DEBOUNCE = {**debounce(SETTINGS), "at_height": 0.05, "range_ok": 0.05}
LIMITS = ChargerLimits(ChargerDurations(start_timeout_s=60.0), debounce=DEBOUNCE)
GOOD = {"charging": False, "ready": True, "fault": False, "at_height": True, "range_ok": True}
LOST = "station: the pad left its height under power"


class Contacts(Story):
    """A story whose station is read through its contacts."""

    def shows(self, *, lasts: float, **contacts: bool) -> "Contacts":
        """Read the contacts, which stay so for `lasts` (s), also when the core wakes."""
        until = self.now + lasts
        while True:
            enabled = self.outputs.power is True
            self.event(Sampled(decode({**GOOD, **contacts}, enabled)))
            self.powered.append(self.outputs.power)
            if not self.now < self.wakes < until:
                break
            self.now = self.wakes
        self.now = until
        return self

    @property
    def state(self) -> tuple[str, str]:
        return self.told[-1][1:]


def charging() -> Contacts:
    """Return a story at 11 s. The robot of req-1 has charged since 10 s."""
    it = Contacts(LIMITS).shows(lasts=5.0)
    it.event(AMR1)
    it.shows(lasts=5.0).shows(charging=True, lasts=1.0)
    assert (it.state, it.outputs.power) == (("CHARGING", "req-1"), True)
    return it


# ---- CHARGER-SENSING-1: a bounce latches nothing


@pytest.mark.parametrize(
    "bounce",
    [
        {"charging": False},
        {"charging": False, "ready": False},
        {"charging": True, "fault": True},
        {"charging": True, "at_height": False},
        {"charging": True, "range_ok": False},
    ],
    ids=str,
)
def test_a_bounce_during_a_charge_ends_nothing(bounce: dict[str, bool]) -> None:
    it = charging().shows(**bounce, lasts=0.002).shows(charging=True, lasts=600.0)
    assert [line[1:] for line in it.told[-2:]] == [("ASSIGNED", "req-1"), ("CHARGING", "req-1")]
    assert (it.outputs.power, it.faults) == (True, ["CHARGER_UNREACHABLE: not read yet"])


def test_a_bounce_before_the_charge_latches_no_fault_and_starts_nothing() -> None:
    it = Contacts(LIMITS).shows(lasts=1.0).shows(fault=True, lasts=0.002).shows(lasts=1.0)
    it.shows(charging=True, lasts=0.002).shows(lasts=1.0)
    assert [line[1] for line in it.told] == ["ERROR", "IDLE"]


@pytest.mark.parametrize(
    ("change", "state"),
    [
        ({"charging": False, "ready": False}, ("RELEASED", "req-1")),
        ({"charging": True, "fault": True}, ("ERROR", "station: the fault contact")),
        ({"charging": True, "at_height": False}, ("ERROR", LOST)),
    ],
    ids=str,
)
def test_a_change_that_lasts_counts_after_its_debounce(
    change: dict[str, bool], state: tuple[str, str]
) -> None:
    it = charging()
    hold_s = 0.1 if "fault" in change else 0.05
    it.shows(**change, lasts=hold_s)
    assert it.state == ("CHARGING", "req-1")
    assert it.shows(**change, lasts=0.01).state == state


def test_a_bounce_of_the_range_does_not_delay_the_end_of_a_charge() -> None:
    it = charging()
    for range_ok in (True, False, True):
        it.shows(charging=False, ready=False, range_ok=range_ok, lasts=0.02)
    assert it.state == ("RELEASED", "req-1")


def test_a_pad_that_is_low_for_less_than_its_debounce_is_no_fault() -> None:
    it = charging()
    it.limits = replace(LIMITS, debounce={**DEBOUNCE, "at_height": 0.3})
    it.shows(charging=True, at_height=False, lasts=0.25).shows(charging=True, lasts=1.0)
    assert it.state == ("CHARGING", "req-1")


def test_a_failed_reading_restarts_the_debounce() -> None:
    it = charging().shows(charging=True, fault=True, lasts=0.09)
    it.event(SILENT)
    it.shows(charging=True, fault=True, lasts=0.09)
    assert it.state == ("CHARGING", "req-1")
    assert it.shows(charging=True, fault=True, lasts=0.03).state[0] == "ERROR"


def test_a_bounce_of_the_first_readings_after_a_silence_does_not_count() -> None:
    """A station that was unreachable may have changed, so no earlier reading counts either."""
    it = charging()
    it.all([SILENT] * 3)
    it.shows(charging=True, lasts=0.002)
    assert it.state == ("ERROR", "Charger unreachable")
    it.shows(charging=False, lasts=0.002).shows(charging=True, lasts=1.0)
    assert [line[1:] for line in it.told[-2:]] == [
        ("ERROR", "Charger unreachable"),
        ("CHARGING", "req-1"),
    ]
    it.all([SILENT] * 3)
    it.shows(charging=False, ready=False, lasts=1.0)
    assert it.state == ("RELEASED", "req-1")


# ---- CHARGER-SENSING-2: the power does not wait


@pytest.mark.parametrize("contact", [{"fault": True}, {"at_height": False}, {"range_ok": False}])
def test_the_power_is_off_in_the_scan_that_reads_a_danger(contact: dict[str, bool]) -> None:
    it = charging().shows(charging=True, **contact, lasts=0.002)
    assert (it.outputs.power, it.state) == (False, ("CHARGING", "req-1"))


# ---- CHARGER-SENSING-3: the pad leaves its height under power


@pytest.mark.parametrize("lost_for", [1, 5])
def test_a_failed_poll_after_a_danger_switches_nothing_on_again(lost_for: int) -> None:
    it = charging()
    for _ in range(3):
        it.event(Sampled(decode({**GOOD, "charging": True, "fault": True}, True)))
        orders = [it.outputs.power]
        for _ in range(lost_for):
            it.now += 0.05
            it.event(SILENT)
            orders.append(it.outputs.power)
        assert orders[0] is False
        assert True not in orders


def test_a_failed_poll_after_a_rival_has_gone_switches_nothing_on_again() -> None:
    it = charging()
    it.event(RivalSeen())
    assert it.outputs.power is False
    it.now += 3.0
    it.event(SILENT)
    it.now += 3.0
    it.event(SILENT)
    assert it.outputs.power is False


def test_a_fault_in_the_first_reading_after_a_silence_is_off_before_it_settles() -> None:
    it = charging()
    it.all([SILENT] * 3)
    it.event(Sampled(decode({**GOOD, "charging": True, "fault": True}, True)))
    assert it.outputs.power is False


def test_a_lost_height_is_a_fault_although_the_power_ended_the_charge_before_it_counted() -> None:
    it = charging().shows(charging=True, at_height=False, lasts=0.01)
    it.shows(at_height=False, lasts=1.0).shows(at_height=False, lasts=1.0)
    assert it.state == ("ERROR", f"out of service after: {LOST}")
    it.event(RESET)
    it.shows(at_height=False, lasts=3.0).shows(at_height=False, lasts=1.0).event(AMR2)
    assert it.state == ("ASSIGNED", "req-2")


def test_a_station_that_goes_on_charging_at_a_lost_height_is_to_be_cut_off() -> None:
    it = charging()
    for _ in range(60):
        it.shows(charging=True, at_height=False, lasts=1.0)
    assert it.outputs.power is False
    said = "station: it goes on charging after an order to stop; cut its supply"
    assert f"PROTECTION: out of service after: {said}" in it.faults


def test_a_pad_that_sinks_after_the_charge_is_no_fault_even_if_charging_bounces() -> None:
    it = charging().shows(charging=False, ready=False, at_height=False, lasts=1.0)
    it.shows(charging=True, ready=False, at_height=False, lasts=0.002)
    it.shows(charging=False, ready=False, at_height=False, lasts=1.0)
    assert it.state == ("RELEASED", "req-1")


# ---- a poll fails now and then


def test_a_bus_that_fails_at_every_second_poll_makes_no_charger_unreachable() -> None:
    """A failed poll restarts the debounce, but what has settled still counts."""
    it = charging()
    for _ in range(10):
        it.event(SILENT)
        it.shows(charging=True, lasts=0.02)
    assert (it.state, it.outputs.power) == (("CHARGING", "req-1"), True)


# ---- CHARGER-SENSING-4: contacts that never settle


def test_a_fault_contact_that_never_settles_is_a_fault() -> None:
    it = charging()
    until = it.now + RESTLESS_S + 0.2
    while it.now < until:
        it.shows(charging=True, fault=True, lasts=0.02).shows(charging=True, lasts=0.02)
    assert it.state == ("ERROR", "station: the fault contact")
    it.shows(lasts=1.0).shows(lasts=1.0)
    assert it.state == ("ERROR", "out of service after: station: the fault contact")

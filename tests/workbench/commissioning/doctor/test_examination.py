"""The doctor's examination of one lift's file, from the first subject to the last. One made-up
Raspberry Pi has no fault, and another has many faults."""

from pathlib import Path

from bridges.settings.load import load
from tests.workbench.commissioning.doctor.made_up import MadeUp
from workbench.commissioning.doctor.chips import devices
from workbench.commissioning.doctor.examination import Options, examined
from workbench.commissioning.doctor.finding import exit_code
from workbench.commissioning.doctor.users import UNIT

LIFT = Path(__file__).parents[4] / "config" / "lift_dry_contact.yaml"
PERSIST = "/sys/module/pinctrl_bcm2835/parameters/persist_gpio_outputs"


def pi(root: Path) -> MadeUp:
    """Return a Raspberry Pi 4 on which the doctor finds no fault."""
    root.mkdir()
    made = MadeUp(root)
    made.chip(0, "pinctrl-bcm2711")
    made.write(f"/etc/systemd/system/{UNIT}")
    made.write("/etc/passwd", "rmf-bridge:x:990:991::/:/usr/sbin/nologin\n")
    made.command("systemctl", "10s\n")
    made.write("/dev/watchdog0")
    made.write(PERSIST, "N\n")
    return made


def levels(made: MadeUp, tmp_path: Path) -> tuple[int, list[tuple[str, str]]]:
    asked = Options(runtime_dir=str(tmp_path / "run"))
    found = list(examined(load(LIFT), None, made.machine, asked))
    return exit_code(found), [(one.subject, one.level) for one in found if one.subject != "disk"]


def test_on_a_machine_that_is_set_up_well_all_is_well(tmp_path: Path) -> None:
    code, found = levels(pi(tmp_path / "pi"), tmp_path)
    subjects = ["file", "user", "clock", "watchdog", "daemon", *["gpio"] * 3]
    subjects += ["gpio at boot", "gpio after a death"]
    warned = [("file", "note")] * len(load(LIFT).warnings)
    well = [(subject, "ok") for subject in subjects]
    assert (code, found) == (0, [well[0], *warned, *well[1:]])


def test_each_problem_is_reported_and_the_rest_is_examined_all_the_same(
    tmp_path: Path,
) -> None:
    made = pi(tmp_path / "pi")
    made.chip(0, "pinctrl-bcm2711", held={18: "other"}, mode=0o600)
    made.synchronised = False
    made.command("systemctl", "0\n")
    made.write(PERSIST, "Y\n")
    made.write("/etc/group", "root:x:0:\n")
    made.write("/boot/firmware/config.txt", "gpio=16=op,dh\n")
    code, found = levels(made, tmp_path)
    amiss = [one for one in found if one[1] in ("warning", "wrong")]
    assert (code, amiss) == (
        2,
        [
            ("user", "wrong"),
            ("clock", "warning"),
            ("watchdog", "warning"),
            ("gpio", "wrong"),
            ("gpio", "wrong"),
            ("gpio at boot", "wrong"),
            ("gpio after a death", "warning"),
        ],
    )
    assert ("daemon", "ok") in found


def test_chips_are_examined_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    made = pi(tmp_path / "pi")
    made.chip(10, "gpio-sim")
    made.chip(2, "gpio-sim")
    assert [path.name for path in devices(made.machine)] == ["gpiochip0", "gpiochip2", "gpiochip10"]

"""Checks the fleet alarms of a file. The file's devices must raise one common alarm, and the daemons of
other files must be able to hear of it."""

from collections.abc import Mapping

from bridges.kinds.shared.alarming import AlarmingSettings, disagreements
from bridges.kinds.shared.fields import DeviceSettings
from bridges.kinds.shared.rmf_section import Rmf
from bridges.yaml.parsing import YamlFile
from bridges.yaml.positions import Spot, locate

UNSEEN = (
    "an alarm needs diagnostics: daemons state their alarms on /diagnostics. Without this statement,"
    " the end of another alarm would end this alarm too. Delete diagnostics: false"
)


def note_alarms(
    page: YamlFile, devices: Mapping[str, DeviceSettings], rmf: Rmf, spot: Spot, of_rmf: Spot | None
) -> None:
    """Note each alarm that contradicts another alarm of the file, and each alarm of which other daemons
    cannot hear.

    `spot`: the place of the section with the devices. `of_rmf`: the place of the section `rmf`.
    """
    found = {n: one for n, one in devices.items() if isinstance(one, AlarmingSettings)}
    for name, text in disagreements(found):
        page.note(locate(spot, (name, "alarm")).where(), text)
    if of_rmf and not rmf.diagnostics and any(one.alarm != "none" for one in found.values()):
        page.note(locate(of_rmf, ("diagnostics",)).where(), UNSEEN)

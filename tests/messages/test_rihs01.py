from typing import Any

import pytest

from bridges.messages import definitions as d
from bridges.messages.releases import JAZZY, KILTED
from bridges.messages.rihs01 import releases_of, type_hash

SEEN_ON_JAZZY = {
    d.LiftRequest: "e8f1e0aa4d172703d0d7840c1876448c6c5d75ab58955faf7de7dddc17c096ac",
    d.LiftState: "ce0553cd08eeeb321bdae554efdb6d2ebb2be9755df2e34895cbef55b51f4c06",
    d.DoorRequest: "3145b5d97064f89b0a0db953b8167ddeeefbc2914c24a603c3bdc51f122f143e",
    d.DoorState: "1cb9d98f19c66cbc1f9acb16faaa90c63a7b65021bd26c69958d96f0a0388bb2",
    d.ChargerState: "13638f4a1149cb44d0e56c42f41e2ea752846d25010e16de13f2d1b05f4fe9f0",
}
"""Type hashes that nodes of ROS 2 Jazzy announce. These nodes were built from rmf_internal_msgs."""

COMPUTED_BY_ROSBAGS = {
    d.Time: "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
    d.Duration: "e8d009f659816f758b75334ee1a9ca5b5c0b859843261f14c7f937349599d93b",
    d.Bool: "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    d.DoorMode: "02c834bb83aa3ca1fbd8cf4f61a1d1ae4dc8227111bde3820dda580f8c2c6429",
    d.Session: "276fee3ca5122cdca08d00b86e2f27009f5938bba19d90a65a1fcb99f4ec994d",
    d.DoorSessions: "62e2203fd2335db5b1bf51a94e0cdbd4e08f85989635179d4f69d9d75963cdce",
    d.SupervisorHeartbeat: "6537eeea544846a14c47bce940894d9c1887c179d698b9cc22855b219b3262b2",
    d.ChargerRequest: "ead03937294b4a404f80dbd86974208c6ab8ab7f22f12501e90f43c3036fb870",
    d.ChargerCancel: "b439d5d5f2dd726953fb24339764c26d2c1cd21f37f072ecdb4be3530270760b",
    d.DispenserRequestItem: "b2164f637d5c5f7d24d1b31fc6c2021dc035b141d791f911f35d71e9a269cb70",
    d.DispenserRequest: "7ec5cdc70d410d350d5bed926be9259398fc6dcdfdde4fb01045a54d52dc710d",
    d.DispenserState: "aa32fa194292db4812a88b9fb28d37e298ac02452fec4fbccb3bd8d5328bdbde",
    d.DispenserResult: "3bc8f58ccb25de185e1c78fd10dcd1bac8fad6383469e244b04e02759d311c92",
    d.IngestorRequestItem: "933e04b43b65ff72163fc52d1b094af6d893d2143256ac859a6891a2e25b3da7",
    d.IngestorRequest: "7229efe532cb695490147828c2204e456e82fbbd11d4ffc90e2a583616f3ff9d",
    d.IngestorState: "31650b33e9de5311fee75701fc3d15920df906a402ef22c5ebb1490582f08b08",
    d.IngestorResult: "e3ef2ece25fa8f71c945b85f8216a2a031cedd37d1145af5225d363407f56127",
    d.EmergencySignal: "2bcead0701ac71c292f12ba705ad9164b796b2660ae48cbf74204515fe5156e0",
    d.Location: "6136f1fc14b896b572c34746c55dbbfd8862e3c561ad5c957ee8b0c116a0e8df",
    d.RobotMode: "9cd4cf773031229f5373fd1b942acf16d140664b79e2463b5e476c1ef6933b2d",
    d.RobotState: "92afab7de71fff5ec992cb0e9809268335c358adefc4a503bf9c3ce075da0c9f",
    d.FleetState: "9ea5bb9f2c076a587b20c04974581c8d8e2ec7d02300244f9e39e37d7d9192f4",
    d.ChargingAssignment: "27edadbe78b4d415522ee28a3954a10c19fa7a3a9a541d9b1381ab3556ca9f00",
    d.ChargingAssignments: "564f81473334b99f91cb3041e4b2f6dee83c755684b84af88e1f10314c126408",
    d.AlertParameter: "e9a425e5c02657274d36ceeba4f9132e02c309e7796c4f819732cc8f5f4269f3",
    d.Alert: "3da5029edcd10f458262542961e3ff75e9e20d2d028f0d5235ab672af39ebfbb",
}
"""Hashes of the .msg files at rmf_internal_msgs 3d4df02. `hash_rihs01` of rosbags 0.11 computed
them."""

BUILT_INTO_JAZZY = {
    d.Header: "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    d.KeyValue: "d68081eaa540288c5440753baecef0c4e16e81a5f78ad68902ded5100413bb42",
    d.DiagnosticStatus: "b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4",
    d.DiagnosticArray: "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
}
"""Hashes from `share/<package>/msg/*.json`. A build of common_interfaces 5283bd9 (5.3.5) installed
these files."""

JAZZYS: dict[Any, str | None] = {
    d.RobotMode: "f918d799fdbf77196b097b077858ebb2efe6685ab543564b69487fe7124638e7",
    d.RobotState: "d282ea1548666b2b1fba5fc8cf07914886cdee8ac2499487e90eb15fd106de76",
    d.FleetState: "ab4c31fc97ae2ed5abc92262baac1597a7c91728031f514507ba155ef8d97cf3",
    d.EmergencySignal: None,
    d.Alert: None,
    d.AlertParameter: None,
}
"""The hashes that differ in Jazzy. None means that Jazzy lacks the message.

rosbags 0.11 computed these hashes from the .msg files at tag 3.3.1 (a351d51). For 3.5.0 (kilted,
c0f72ce) rosbags computes the same hashes as for 4.1.0.
"""

HASHES: dict[Any, str] = {**SEEN_ON_JAZZY, **COMPUTED_BY_ROSBAGS, **BUILT_INTO_JAZZY}


def test_every_type_has_a_hash_to_compare_with() -> None:
    assert HASHES.keys() == d.PACKAGES.keys()


@pytest.mark.parametrize("message_type", HASHES, ids=lambda kind: kind.__name__)
def test_the_hash_of_a_type_is_the_one_that_ros_computes(message_type: Any) -> None:
    assert type_hash(message_type) == "RIHS01_" + HASHES[message_type]


def test_hashes_of_jazzy_differ_only_for_files_that_differ() -> None:
    jazzys: dict[Any, str | None] = {**HASHES, **JAZZYS}
    wanted = {kind: "RIHS01_" + hashed for kind, hashed in jazzys.items() if hashed is not None}
    assert {kind: type_hash(kind, JAZZY) for kind in JAZZY.messages()} == wanted


def test_a_hash_identifies_a_release_if_only_one_release_has_it() -> None:
    assert releases_of("RIHS01_" + HASHES[d.FleetState]) == [KILTED]
    assert releases_of("RIHS01_" + str(JAZZYS[d.FleetState])) == [JAZZY]
    assert releases_of("RIHS01_" + HASHES[d.LiftState]) == [JAZZY, KILTED]
    assert releases_of("RIHS01_0") == []

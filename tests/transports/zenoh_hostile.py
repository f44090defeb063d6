"""A hostile program: `python -m tests.transports.zenoh_hostile ENDPOINT KEY GOOD TOKEN`.

First the program sends, under KEY, some samples that no ROS node sends. Then it sends ten thousand
malformed samples as fast as possible. In the end it sends GOOD (hexadecimal digits) again and again, as
a ROS node does, until its stdin ends.
"""

import json
import sys
import threading
import time

import zenoh

from bridges.messages import definitions as d
from bridges.messages.cdr import encode
from bridges.messages.rihs01 import type_hash
from tests.transports.rmw_zenoh_reader import gid
from tests.transports.zenoh_programs import meeting

FLOOD = 10_000
GOOD = d.LiftRequest("Lift1", d.Time(5, 6), "fleet/robot", 1, "L3", 2)


def arguments(domain: int) -> tuple[str, str, str, str]:
    """Return the program's arguments for an attack on the lifts of a domain on this machine."""
    kind = f"rmf_lift_msgs::msg::dds_::LiftRequest_/{type_hash(d.LiftRequest)}"
    token = f"@ros2_lv/{domain}/5e/0/7/MP/%/%/liar/%lift_requests/{kind}/::,10:,:,:,,"
    good = encode(d.LiftRequest, GOOD).hex()
    return meeting(domain), f"{domain}/lift_requests/{kind}", good, token


def main(endpoint: str, key: str, text: str, token: str) -> None:
    config = zenoh.Config()
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    good = bytes.fromhex(text)
    with zenoh.open(config) as session:
        alive = session.liveliness().declare_token(token)
        attached = (1).to_bytes(8, "little") + bytes(8) + b"\x10" + gid(token)
        publisher = session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)
        while not publisher.matching_status:
            time.sleep(0.01)
        publisher.put(good)  # without an attachment
        publisher.put(good, attachment=attached[:-1])
        publisher.put(good, attachment=attached[:16] + b"\x11" + attached[17:])
        publisher.put(good[:20], attachment=attached)
        publisher.put(b"", attachment=attached)
        publisher.put(good[:4] + b"\xff" * (10 << 20), attachment=attached)
        publisher.put(good + bytes(10 << 20), attachment=attached)
        publisher.delete(attachment=attached)
        wrong_hash = key[:-64] + "0" * 64
        session.put(wrong_hash, good, attachment=attached)
        session.put(key.rsplit("/", 1)[0] + "/*", good, attachment=attached)
        ended = threading.Event()
        threading.Thread(target=end, args=(ended,)).start()
        for _ in range(FLOOD):
            publisher.put(b"\0\1\0\0garbage", attachment=attached)
        print("flooded", flush=True)  # noqa: T201
        while not ended.wait(0.05):
            publisher.put(good, attachment=attached)
        del alive


def end(ended: threading.Event) -> None:
    sys.stdin.read()
    ended.set()


if __name__ == "__main__":
    main(*sys.argv[1:])

"""A program that lies: `python -m tests.rmf.zenoh_hostile ENDPOINT KEY GOOD TOKEN` sends what is no sample
of a ROS node under KEY, then GOOD (hex) as one until its stdin ends, with ten thousand a second between.
"""

import json
import sys
import threading
import time

import zenoh

from tests.rmf.rmw_zenoh_reader import gid

FLOOD = 10_000


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
        publisher.put(good)  # without attachment
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
        threading.Thread(target=lambda: (sys.stdin.read(), ended.set())).start()
        for _ in range(FLOOD):
            publisher.put(b"\0\1\0\0garbage", attachment=attached)
        print("flooded", flush=True)  # noqa: T201
        while not ended.wait(0.05):
            publisher.put(good, attachment=attached)
        del alive


if __name__ == "__main__":
    main(*sys.argv[1:])

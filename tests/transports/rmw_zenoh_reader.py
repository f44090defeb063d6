"""An independent program on zenoh, written from the documents of rmw_zenoh and zenoh-bridge-ros2dds.

`python tests/transports/rmw_zenoh_reader.py ENDPOINT ORDER…` carries out one order after the other. The
program shares no code with `bridges/`. It ends when its stdin ends. Each line of its output is JSON.

- `tokens PATTERN` prints each liveliness token that matches, when the token comes and when it goes.
- `samples KEY` prints each sample under a key. zenoh's own deserializer decodes the attachment.
- `history KEY DEPTH` prints the same as `samples`, but subscribes to retained messages as rmw_zenoh
  does.
- `say KEY TOKEN HEX [DEPTH]` waits for a subscriber, and then publishes as rmw_zenoh does. With DEPTH
  the publisher retains messages.
"""

import json
import struct
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import xxhash
import zenoh
from zenoh import ext

PRINTING = threading.Lock()


def main(endpoint: str, *orders: str) -> None:
    config = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "connect/endpoints": [endpoint],
        "connect/exit_on_failure": False,
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
    }.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        kept = [ORDERS[order.split(" ")[0]](session, *order.split(" ")[1:]) for order in orders]
        sys.stdin.read()
        del kept


def tell(**line: object) -> None:
    with PRINTING:
        sys.stdout.write(json.dumps(line) + "\n")
        sys.stdout.flush()


def tokens(session: zenoh.Session, pattern: str) -> Any:
    return session.liveliness().declare_subscriber(
        pattern,
        lambda sample: tell(
            token=str(sample.key_expr), is_there=sample.kind == zenoh.SampleKind.PUT
        ),
        history=True,
    )


def samples(session: zenoh.Session, key: str) -> Any:
    return session.declare_subscriber(key, tell_sample)


def history(session: zenoh.Session, key: str, depth: str) -> Any:
    return ext.declare_advanced_subscriber(
        session,
        key,
        tell_sample,
        history=ext.HistoryConfig(detect_late_publishers=True, max_samples=int(depth)),
        recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        subscriber_detection=True,
    )


def tell_sample(sample: zenoh.Sample) -> None:
    attached = sample.attachment
    parts: Any = None
    if attached is not None:
        parts = ext.z_deserialize(tuple[ext.Int64, ext.Int64, bytes], attached)
    tell(
        key=str(sample.key_expr),
        sample=bytes(sample.payload).hex(),
        attachment_bytes=len(bytes(attached)) if attached is not None else None,
        number=parts and int(parts[0]),
        sent_ns=parts and int(parts[1]),
        gid=parts and parts[2].hex(),
    )


def gid(token: str) -> bytes:
    """Return the token's 128-bit XXH3 hash as bytes: first the low half, then the high half, both
    little-endian. liveliness_utils.cpp does the same."""
    both = xxhash.xxh3_128_intdigest(token.encode())
    return struct.pack("<QQ", both & (1 << 64) - 1, both >> 64)


def say(session: zenoh.Session, key: str, token: str, payload: str, depth: str = "") -> Any:
    token = token.replace("SESSION", str(session.zid()))
    if depth:
        publisher: Any = ext.declare_advanced_publisher(
            session,
            key,
            cache=ext.CacheConfig(max_samples=int(depth)),
            sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5),
            publisher_detection=True,
        )
    else:
        publisher = session.declare_publisher(key)
    alive = session.liveliness().declare_token(token)
    if not depth:
        while not publisher.matching_status:
            time.sleep(0.01)
    attachment = ext.z_serialize((ext.Int64(1), ext.Int64(time.time_ns()), gid(token)))
    is_bridge = token.startswith("@/")  # a bridge's samples have no attachment
    publisher.put(bytes.fromhex(payload), attachment=None if is_bridge else attachment)
    tell(said=key)
    return publisher, alive


ORDERS: dict[str, Callable[..., Any]] = {
    "tokens": tokens,
    "samples": samples,
    "history": history,
    "say": say,
}

if __name__ == "__main__":
    main(*sys.argv[1:])

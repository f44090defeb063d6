"""Timestamps for messages whose protocol wants the time of day. No code calculates a duration from
these timestamps."""

import time


def utc() -> str:
    """Return the time of day as ISO 8601 in UTC, with milliseconds (`2026-11-24T06:30:00.123Z`)."""
    now = time.time_ns() // 1_000_000
    seconds = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(now // 1000))
    return f"{seconds}.{now % 1000:03d}Z"

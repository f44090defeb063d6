"""A stand-in for rclpy. `write` puts it into a separate folder. With this stand-in a daemon starts, and
then refuses to run because messages are missing.

A real rclpy executor has a thread. If this thread still runs when the interpreter ends, rclpy aborts
the process (SIGABRT). The reason is that the thread still uses deleted C++ objects. Instead of
aborting, the stand-in prints whether the thread still runs.
"""

from pathlib import Path

RCLPY = """
import atexit, sys, threading
spinning = set()
def told():
    print("outlived" if any(t.is_alive() for t in spinning) else "joined", file=sys.stderr)
atexit.register(told)
"""
CONTEXT = """
class Context:
    def __init__(self): self.valid = False
    def init(self, args, initialize_logging, domain_id): self.valid = True
    def ok(self): return self.valid
    def try_shutdown(self): self.valid = False
"""
NODE = """
import threading
class Guard:
    def __init__(self): self.rung = threading.Event()
    def trigger(self): self.rung.set()
class End:
    def get_subscription_count(self): return 0
    def get_publisher_count(self): return 0
    def publish(self, sample): pass
class Clock:
    def now(self): raise RuntimeError
class Node:
    def __init__(self, name, **options): self.name = name
    def get_clock(self): return Clock()
    def get_name(self): return self.name
    def create_guard_condition(self, callback):
        self.guard = Guard()
        return self.guard
    def create_publisher(self, *what, **options): return End()
    def create_subscription(self, *what, **options): return End()
    def destroy_publisher(self, end): pass
    def destroy_node(self): pass
    def get_publishers_info_by_topic(self, name): return []
    def get_subscriptions_info_by_topic(self, name): return []
"""
EXECUTORS = """
import threading, rclpy
class SingleThreadedExecutor:
    def __init__(self, context): pass
    def add_node(self, node): self.node = node
    def spin_once(self, timeout_sec):
        rclpy.spinning.add(threading.current_thread())
        self.node.guard.rung.wait()
    def shutdown(self): pass
"""
QOS = """
from enum import Enum
class DurabilityPolicy(Enum): VOLATILE, TRANSIENT_LOCAL = 1, 2
class HistoryPolicy(Enum): KEEP_LAST = 1
class ReliabilityPolicy(Enum): RELIABLE = 1
class QoSProfile:
    def __init__(self, **options): pass
def qos_policy_name_from_kind(kind): return str(kind)
"""
EVENTS = """
class PublisherEventCallbacks:
    def __init__(self, **options): pass
class SubscriptionEventCallbacks(PublisherEventCallbacks): pass
"""
PUBLISHER = "class Publisher: pass\n"
SUBSCRIPTION = "class Subscription: pass\n"
EXCEPTIONS = "class NameValidationException(Exception): pass\n"
MODULES = {
    "__init__": RCLPY,
    "context": CONTEXT,
    "node": NODE,
    "executors": EXECUTORS,
    "qos": QOS,
    "event_handler": EVENTS,
    "exceptions": EXCEPTIONS,
    "publisher": PUBLISHER,
    "subscription": SUBSCRIPTION,
}
PACKAGES = (
    *("builtin_interfaces", "rmf_lift_msgs", "rmf_door_msgs", "rmf_charger_msgs"),
    *("rmf_fleet_msgs", "rmf_task_msgs", "std_msgs", "diagnostic_msgs"),
)


def write(folder: Path) -> None:
    """Write the stand-in for rclpy, and empty message packages."""
    for name, text in MODULES.items():
        (folder / "rclpy").mkdir(exist_ok=True)
        (folder / "rclpy" / f"{name}.py").write_text(text)
    for package in PACKAGES:
        (folder / package).mkdir()
        (folder / package / "__init__.py").touch()
        (folder / package / "msg.py").touch()

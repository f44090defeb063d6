"""It hears adapter_door_requests: one robot's CLOSE closes on another."""

from bridges.messages import topics
from tests.workbench.judge.nodes.right_door import RightDoor


class DoorHearsAdapters(RightDoor):
    subscribes = (topics.ADAPTER_DOOR_REQUESTS,)

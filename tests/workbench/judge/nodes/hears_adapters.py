"""It hears adapter_lift_requests, around the supervisor."""

from bridges.messages import topics
from tests.workbench.judge.nodes.right_lift import RightLift


class HearsAdapters(RightLift):
    subscribes = (topics.ADAPTER_LIFT_REQUESTS,)

"""The service of a fleet. The robots are on buses, as other devices are. RMF's fleet adapter, and not
ROS topics, brings the requests."""

import itertools
import logging
import os
from collections.abc import Callable, Collection
from contextlib import suppress
from typing import Any, Final, cast

from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.settings import FleetFiles
from bridges.kinds.fleet.signals import Order
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO
from bridges.kinds.shared.kind import AnyDeviceKind
from bridges.messages.definitions import ChargerState, FleetState, Message, RobotState
from bridges.messages.stamps import ClockError
from bridges.messages.topics import CHARGER_STATES, FLEET_STATES, Topic
from bridges.runtime.clock import TELL_EVERY_S, Clock
from bridges.runtime.device import AnyNode, Node
from bridges.runtime.device_memory import DeviceMemories
from bridges.runtime.fleet.adapter import FleetAdapter, installed
from bridges.runtime.fleet.robot import AGAIN_S
from bridges.runtime.inbox import Inbox
from bridges.runtime.outlet import Named
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.service import Devices, OpenBus
from bridges.runtime.serving import Serving
from bridges.runtime.subject import Status
from bridges.settings.config import Config
from bridges.settings.fleet_site import limits_of, read_site
from bridges.system.log import pairs
from bridges.transports.transport import Transport
from drivers.hal import Bus

log = logging.getLogger(__name__)

LOOK_S: Final = 0.5


class RobotNode(Node[Any, Any, Any, Any, Any, Any, RobotReport]):
    """The node of one robot. The robot's report goes to RMF's adapter.

    With a traffic light RMF's adapter publishes no states of the fleet, so the nodes do this. `told`
    has the last state of each robot, and `tell()` publishes these states.
    """

    adapter: FleetAdapter
    told: dict[str, RobotState]
    tell: Callable[[], None] | None = None

    def _send(self, report: RobotReport) -> bool:
        self.adapter.update(self.name, report)
        message = self._kind.state_message
        if self.tell is not None and message is not None and report.read_at is not None:
            with suppress(ClockError):
                at = self._clock.stamp(report.read_at)
                state = message(self.name, self._settings, report, at)
                self.told[self.name] = cast(FleetState, state).robots[0]
            self.tell()
        return True


class Joining:
    """The thread that joins RMF. It tries again until RMF's schedule node answers."""

    name = "rmf-adapter"

    def __init__(self, adapter: FleetAdapter, clock: Clock) -> None:
        self.inbox: Inbox[object] = Inbox()
        self.joined = False
        self.wake_at = AGES_AGO
        self.finished = 0
        self.ready = True
        self._adapter = adapter
        self._clock = clock
        self._again_at = AGES_AGO

    def round(self) -> None:
        """Join RMF, if an attempt is due. The daemon starts to serve even if RMF cannot be joined."""
        now = self._clock.monotonic()
        self.wake_at = now + LOOK_S
        if self.joined or now < self._again_at:
            return
        told = self._again_at > AGES_AGO
        self.joined = self._adapter.connect()
        self._again_at = self._clock.monotonic() + AGAIN_S
        if self.joined:
            log.info(pairs("rmf_joined", name=self._adapter.name))
        elif not told:
            log.warning(pairs("rmf_not_joined", reason=NO_SCHEDULE, again_s=AGAIN_S))

    def end(self) -> bool:
        """Leave RMF's graph."""
        self._adapter.close()
        return True


NO_SCHEDULE: Final = "no schedule node: is rmf_traffic_schedule running in this ROS domain?"


class FleetDevices(Devices):
    """The robots of one fleet."""

    def __init__(
        self,
        config: Config,
        kind: AnyDeviceKind,
        transport: Transport,
        open_bus: OpenBus,
        named: Named,
        clock: Clock,
        unsafe: Collection[str] = (),
        writer: NoWriter = NOBODY,
        memories: DeviceMemories | None = None,
        *,
        rmf: Any,
    ) -> None:
        """Prepare the service. `rmf`: an object that replaces the module `rmf_adapter` in a simulation.
        If it is None, the real module is used.

        Raises SettingsError for an error in RMF's files, and TransportError if the module is missing.
        """
        assert isinstance(config.section, FleetFiles)
        self._site = read_site(config)
        self._stands_in = rmf is not None
        self._light = config.section.control == "traffic_light"
        self._told: dict[str, RobotState] = {}
        self._tell_at = AGES_AGO
        numbers = itertools.count(int(transport.wall()))
        uri = config.section.server_uri
        rmf = installed() if rmf is None else rmf
        os.environ["ROS_DOMAIN_ID"] = str(transport.domain_id)  # RMF's adapter makes its own node
        if config.rmf.network == "localhost":
            os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        put, light = self._order, self._light
        self._adapter = FleetAdapter(rmf, self._site, uri, put, numbers, light=light)
        super().__init__(
            config,
            kind,
            transport,
            open_bus,
            named,
            clock,
            unsafe,
            writer,
            memories=memories if light else None,
        )
        if self._stands_in:
            rmf.speak = self._speak
        self._joining = Joining(self._adapter, clock)
        self.loops = [*self.loops, Serving(self._joining, clock)]
        for note in self._site.notes():
            log.info(pairs("map", text=note))

    def subscribe(self) -> None:
        """Subscribe to the states of the chargers."""
        accept = self._kind.requests[CHARGER_STATES]
        hear = self._to_inbox(CHARGER_STATES, accept)
        ours = ("", self._site.fleet.fleet.name)

        def ours_only(message: Message) -> None:
            assert isinstance(message, ChargerState)
            if message.robot_fleet in ours and message.robot_name in self._placed:
                hear(message)

        topic = self._named(CHARGER_STATES)
        self._hears[CHARGER_STATES.name] = self._transport.subscribe(topic, ours_only)

    def status(self) -> Status:
        """Return the status of the service, with the state of RMF's adapter."""
        found = super().status()
        failed = self._adapter.failed.copy().items()
        missing = [Fault("RMF_TAKES_NO_ROBOT", f"{name}: {why}") for name, why in failed if why]
        if not self._joining.joined:
            missing.append(Fault("RMF_NOT_JOINED", NO_SCHEDULE))
        told = [{"code": fault.code, "detail": fault.detail} for fault in missing]
        joined = "stand-in of RMF" if self._stands_in else "joined"
        rmf = joined if self._joining.joined else "not joined"
        faults = [*found["faults"], *told]
        return {**found, "faults": faults, "rmf_adapter": rmf, "fleet": self._site.fleet.fleet.name}

    def _topics(self) -> list[Topic[Message]]:
        return [FLEET_STATES] if self._stands_in or self._light else []

    def _node(self, name: str, bus: Bus) -> AnyNode:
        device = self._config.devices[name]
        driver_type = self._config.driver_type(name)
        limits = limits_of(self._config, name, driver_type.debounce(device))
        driver = driver_type.create(name, device, bus)
        out, clock, writer = self._outlet, self._clock, self._writer
        kept = self._memories
        node = RobotNode(
            name, self._kind, device, limits, driver, out.publish, clock, writer, memories=kept
        )
        node.adapter, node.told = self._adapter, self._told
        node.tell = self._tell if self._light else None
        return node

    def _tell(self) -> None:
        """Publish the states of all robots each second."""
        now = self._clock.monotonic()
        if now >= self._tell_at:
            self._tell_at = now + TELL_EVERY_S
            robots = tuple(self._told.copy().values())
            self._outlet.publish(FLEET_STATES, FleetState(self._site.fleet.fleet.name, robots))

    def _order(self, robot: str, order: Order) -> None:
        """Put an order of RMF into the inbox of the robot's bus. Any thread may call this method."""
        _, loop = self._placed[robot]
        loop.inbox.put(robot, order)

    def _speak(self, state: FleetState) -> None:
        """Publish the fleet's state for the stand-in, which replaces RMF's adapter in a simulation. The
        real adapter publishes the state itself, so it does not call this method."""
        self._outlet.publish(FLEET_STATES, state)

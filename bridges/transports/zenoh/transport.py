"""The `zenoh` transport. To other nodes, its session looks like a ROS node on rmw_zenoh. With the other
naming scheme, it looks like a zenoh-bridge-ros2dds that has one node behind it.

zenoh reconnects by itself. It keeps looking for its routers. When a router answers, zenoh declares all
publishers and subscriptions to it again. This transport opens a new session only when the machine's
addresses have changed. The old session would notice that change only after its links time out.

Source: eclipse-zenoh 1.10 (Python API), and the sources named in `keys.py` and `ends.py`. Only this
folder imports zenoh, and only `choose.py` imports this file.
"""

import atexit
import logging
import threading
import time
from collections.abc import Callable
from functools import partial
from itertools import count
from queue import Empty, SimpleQueue
from typing import Final

import zenoh
from zenoh.handlers import Callback

from bridges.kinds.shared.rmf_section import Zenoh
from bridges.messages.releases import Release
from bridges.messages.topics import AnyTopic, Topic
from bridges.system.log import pairs
from bridges.transports import addresses, notices
from bridges.transports.threaded import LOOK_EVERY_S, Threaded
from bridges.transports.transport import M, TransportError, any_type
from bridges.transports.zenoh import config as zenoh_config
from bridges.transports.zenoh.alone import ROUTER_MET, WHY_AWAY, Alone
from bridges.transports.zenoh.ends import ZenohEnd, ZenohPublisher, ZenohSubscription
from bridges.transports.zenoh.keys import WAYS, Keys
from bridges.transports.zenoh.peers import Merged, Order, Tokens, ZenohPeers
from bridges.transports.zenoh.session import closed, contained, opened, trim_memory

log = logging.getLogger(__name__)

UNLINKED: Final = "NO_ROUTER"
NO_ROUTER: Final = (
    "no router answers, or the router refuses this node: RMF hears nothing until a router accepts"
    " this node"
)


class ZenohTransport(Threaded):
    """One node: a session, its publishers and subscriptions, and the thread that delivers messages.

    `loopback`: stay on this machine without a router, even if `settings` say otherwise. Raises
    TransportError if no session can be opened. A missing router is no such error: the node tries again.
    """

    speaks = "zenoh"

    refusals = (zenoh.ZError,)

    def __init__(
        self,
        node_name: str,
        domain_id: int,
        *,
        loopback: bool,
        settings: Zenoh | None = None,
        release: Release | None = None,
    ) -> None:
        super().__init__(node_name, domain_id, release)
        self._settings = settings or Zenoh()
        self._loopback = loopback
        self._failed = False
        self._ends: tuple[ZenohEnd, ...] = ()
        self._deaf: set[str] = set()
        self._orders: SimpleQueue[Order] = SimpleQueue()
        do = self._orders.put
        self._watcher = ZenohPeers(self._peers, Merged(do, self._follow_release), do)
        self._looks = Merged(do, self._look)
        self._alone = Alone()
        self._away = False
        self._presence: zenoh.LivelinessToken | None = None
        self._witnesses: Tokens | None = None
        self._session: zenoh.Session | None = None
        self._linked: bool | None = None
        self._met_router = False
        self._look_at = time.monotonic() + LOOK_EVERY_S
        self._wants_router = not loopback and zenoh_config.mode(self._settings) == "client"
        self._why_unlinked = ""
        self._closing: list[threading.Thread] = []
        self._neighbours: dict[str, zenoh.WhatAmI] = {}
        self._join()
        if self._session is None and not self._wants_router:
            raise TransportError(f"cannot open a zenoh session: {self._why_unlinked}")
        # If a session is still open when the interpreter exits, the interpreter aborts.
        atexit.register(self.close)
        self._start(self._listen, "zenoh")

    def faults(self) -> list[tuple[str, str]]:
        """Return the faults that every transport has, and also ROUTER_ON_LOOPBACK or NO_ROUTER."""
        found = super().faults()
        if self._away:
            found.insert(0, (ROUTER_MET, WHY_AWAY))
        elif self._linked is False:
            found.insert(0, (UNLINKED, self._why_unlinked or NO_ROUTER))
        return found

    def publisher(self, topic: AnyTopic) -> ZenohPublisher:
        """Declare a publisher with `topic.publish` QoS."""
        publisher = ZenohPublisher(
            topic,
            self._orders.put,
            self._withdraw,
            lambda: self.lives,
            self._deaf,
            self._watcher.tell,
        )
        with self._lock, self._reporting(f"topic {topic.name} cannot be published"), contained():
            self._attach(publisher)
            self._ends += (publisher,)
        return publisher

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> ZenohSubscription:
        """Declare a subscription with `topic.subscribe` QoS. The transport's thread calls
        `received`."""
        subscription = ZenohSubscription(
            topic,
            any_type(received),
            self._orders.put,
            self.dropped,
            self._senders,
            others_only=others_only,
            attached=self._settings.keys == "rmw_zenoh",
            tell=self._watcher.tell,
        )
        with self._lock, self._reporting(f"topic {topic.name} cannot be subscribed"), contained():
            self._attach(subscription)
            self._ends += (subscription,)
        return subscription

    def close(self) -> None:
        """Leave the graph at once, so that other nodes do not still see a dead endpoint. A second call
        does nothing."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        atexit.unregister(self.close)
        self._orders.put(_nothing)
        self._join_thread()
        with self._lock:
            self._leave()
        for closing in self._closing:
            closing.join()

    # --- the session ---------------------------------------------------------------------------

    def _join(self) -> None:
        """Try to open a session, and join the graph in it. A client gets a session only after a router
        has answered.

        The caller does not hold the lock: the attempt takes 10 s if the router's machine is silent, and
        the lock would keep other threads from publishing, and so from their scans.
        """
        session = self._opened()
        if session is None:
            return
        with self._lock:
            if self._closed:
                closed(session, [])
            else:
                self._enter(session)

    def _opened(self) -> zenoh.Session | None:
        self._addresses = addresses.addresses()
        if self._loopback:
            ways = zenoh_config.on_loopback(self.domain_id)
        else:
            ways = [zenoh_config.on_the_site(self._settings)]
        try:
            return opened(ways)
        except zenoh.ZError as error:
            self._why_unlinked = str(error).partition(" at /")[
                0
            ]  # without the place in zenoh's source
            return None

    def _enter(self, session: zenoh.Session) -> None:
        way, name = WAYS[self._settings.keys], str(session.zid())
        self._keys: Keys = way(self.domain_id, name, self.name, self.release)
        self._numbers = count(1)
        self._neighbours = {}
        self._events = session.info.declare_transport_events_listener(
            Callback(partial(self._neighbour, self._neighbours), indirect=False), history=True
        )
        self._session = session
        self._appear(session)
        self._why_unlinked = ""
        trim_memory()

    def _appear(self, session: zenoh.Session) -> None:
        """Declare the node and all its publishers and subscriptions in the session."""
        self._presence = session.liveliness().declare_token(self._keys.presence())
        self._witnesses = self._watcher.watch(session, self._keys)
        for end in self._ends:
            self._attach(end)

    def _vanish(self) -> None:
        """Remove the node and all its publishers and subscriptions from the session. Keep the session
        open, because it shows when the router has gone."""
        for end in self._ends:
            end.leave()
        self._deaf.clear()
        if self._witnesses:
            self._witnesses.leave()
        presence, self._presence = self._presence, None
        if presence:
            presence.undeclare()  # type: ignore[no-untyped-call]

    def _attach(self, end: ZenohEnd) -> None:
        """Declare a publisher or subscription in the session. Do nothing if the node must be off the
        graph, or if the release lacks the message."""
        self._peers.ours(end.topic, publishes=isinstance(end, ZenohPublisher))
        off = self._away or end.place or not self.release.has(end.topic.type)
        if self._session is None or off:
            return
        number = next(self._numbers)
        if isinstance(end, ZenohSubscription) and end.others_only:
            self._deaf.add(self._keys.token("MS", end.topic, number))
        end.create(self._session, self._keys, number)

    def _neighbour(self, neighbours: dict[str, zenoh.WhatAmI], event: zenoh.TransportEvent) -> None:
        """Note that a router or peer has connected or gone. zenoh's thread calls this method.

        This class keeps its own list of neighbours. If it asked the session for them, it would wait for
        a lock that zenoh's thread holds.
        """
        if event.kind == zenoh.SampleKind.PUT:
            neighbours[str(event.transport.zid)] = event.transport.whatami
        else:
            neighbours.pop(str(event.transport.zid), None)
        self._looks()

    def _withdraw(self, publisher: ZenohPublisher) -> None:
        with self._lock, contained():
            if publisher in self._ends:
                self._ends = tuple(end for end in self._ends if end is not publisher)
                publisher.leave()

    def _leave(self) -> None:
        """Leave the session. Another thread closes the session, because closing takes 10 s on a dead
        link.

        Keep the objects that are declared in the session until the session is closed. Dropping them
        earlier may block this thread.
        """
        session, self._session = self._session, None
        held: list[object] = [end.give_up() for end in self._ends]
        self._deaf.clear()
        self._neighbours = {}
        if session:
            held += [self._presence, self._events, self._witnesses]
            closing = threading.Thread(target=closed, args=(session, held), daemon=True)
            try:
                closing.start()
            except RuntimeError:  # Python 3.12.0 and 3.12.1 start no thread in an atexit callback
                closed(session, held)
            else:
                self._closing.append(closing)

    def _join_anew(self) -> None:
        with self._lock:
            if self._closed:
                return
            self._leave()
            self._closing = [closing for closing in self._closing if closing.is_alive()]
        try:
            self._join()
        except (TransportError, zenoh.ZError) as error:  # e.g. a missing secret
            with self._lock:
                self._why_unlinked = str(error)
                self._leave()

    def _follow_release(self) -> None:
        """Adopt RMF's release. Declare each publisher or subscription again if its message differs in
        this release."""
        before = self.release
        if not self._peers.settle():
            self._peers.name_misfits()
            return
        with self._lock:
            if self._closed or self._session is None:
                return
            self._keys.release = self.release
            for end in self._ends:
                if self._peers.differs(end.topic, before):
                    end.leave()
                    self._attach(end)

    # --- our thread ----------------------------------------------------------------------------

    def _listen(self) -> None:
        failures = notices.Failures()
        while not self._closed and not failures.too_many:
            try:
                forever = self._loopback and not self._away
                order = self._orders.get(timeout=None if forever else LOOK_EVERY_S)
            except Empty:
                order = _nothing
            try:
                with contained():
                    order()
                    self._follow_network()
            except Exception as error:  # noqa: BLE001 - logged by _recover
                failures.count(time.monotonic())
                self._recover(error)

    def _recover(self, error: Exception) -> None:
        """Recover from an unexpected exception. Log only the first exception, and open a new
        session."""
        if not self._failed:
            log.exception(pairs("reader_failed", node=self.name, reason=error))
        self._failed = True
        if not self._loopback:
            self._look_at = time.monotonic() + LOOK_EVERY_S
            self._join_anew()

    def _follow_network(self) -> None:
        """Join again if the machine's addresses have changed, or if the node has no session."""
        if self._loopback:
            if self._away:
                self._look()
            return
        if not self._look_is_due():
            return
        self._look()
        if (self._leaves_machine() and self._network_changed()) or self._session is None:
            self._join_anew()

    def _leaves_machine(self) -> bool:
        """Return whether an endpoint in the settings is on another machine."""
        endpoints = (*self._settings.connect, *self._settings.listen)
        return not all(map(zenoh_config.is_local, endpoints))

    def _look(self) -> None:
        """Log when the last router or peer has gone, and when a router or peer is back. With
        `loopback`, leave the graph while a router is connected."""
        neighbours = list(self._neighbours.values())
        routers = zenoh.WhatAmI.ROUTER in neighbours
        if self._loopback:
            self._keep_apart(self._alone.away(routers, time.monotonic()))
            return
        self._met_router |= routers
        linked = routers or (not self._met_router and bool(neighbours))
        if linked == self._linked:
            return
        self._linked = linked
        where = " ".join(self._settings.connect)
        if linked:
            log.info(pairs("linked", node=self.name, connect=where))
        else:
            reason = self._why_unlinked or NO_ROUTER
            log.warning(pairs("not_linked", node=self.name, connect=where, reason=reason))

    def _keep_apart(self, away: bool) -> None:
        """Leave the graph if `away`, because a router is connected. Otherwise return to the graph."""
        with self._lock:
            before, session = self._away, self._session
            if self._closed or session is None or not (before or away):
                return
            self._away = away
            if away and not before:
                log.error(pairs("left_graph", node=self.name, reason=WHY_AWAY))
            try:
                self._vanish() if away else self._appear(session)
            except zenoh.ZError:
                self._away = True  # so that the next check tries again
                raise
        if not away:
            log.info(pairs("back_on_graph", node=self.name))


def _nothing() -> None:
    """Do nothing. The transport's thread waits for functions in the queue `_orders`. This function only
    ends the wait."""

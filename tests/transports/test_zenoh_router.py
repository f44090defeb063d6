"""The transport `zenoh` with routers that come, go or demand credentials, all on 127.0.0.1."""

import logging
import os
import threading
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import trustme

from bridges.kinds.shared.rmf_section import Zenoh, ZenohTls
from bridges.messages import definitions as d
from bridges.messages.topics import FIRE_ALARM_TRIGGER, LIFT_REQUESTS, LIFT_STATES
from bridges.transports import addresses
from bridges.transports.transport import TransportError
from bridges.transports.zenoh import alone as zenoh_alone
from bridges.transports.zenoh import config as zenoh_config
from bridges.transports.zenoh import session
from bridges.transports.zenoh import transport as zenoh_transport
from bridges.transports.zenoh.transport import ZenohTransport
from tests.transports import peer
from tests.transports.joining import Join
from tests.transports.zenoh_programs import Router, free_port, meeting
from tests.waiting import wait_until

DOMAIN = 7


class Site:
    """The routers and nodes of one test."""

    def __init__(self) -> None:
        self.routers: list[Router] = []
        self.nodes: list[ZenohTransport] = []

    def router(self, endpoint: str | None = None, **config: Any) -> Router:
        """Start a router."""
        router = Router(endpoint, **config)
        self.routers.append(router)
        router.start()
        return router

    def node(self, name: str, *connect: str, **settings: Any) -> ZenohTransport:
        """Open a node that connects to these routers."""
        zenoh = Zenoh(connect=connect, **settings)
        self.nodes.append(ZenohTransport(name, DOMAIN, loopback=False, settings=zenoh))
        return self.nodes[-1]


@pytest.fixture
def site() -> Iterator[Site]:
    made = Site()
    yield made
    for node in made.nodes:
        node.close()
    for router in made.routers:
        router.leave()


class Talk:
    """A conversation: one node sends a lift's states, and another node hears them."""

    def __init__(self, speaker: ZenohTransport, listener: ZenohTransport) -> None:
        self.heard: list[str] = []
        self.subscription = listener.subscribe(
            LIFT_STATES, lambda state: self.heard.append(state.lift_name)
        )
        self.publisher = speaker.publisher(LIFT_STATES)

    def arrives(self, text: str) -> bool:
        """Send a state with this text. Return whether that state has arrived."""
        with suppress(TransportError):
            self.publisher.publish(d.LiftState(lift_name=text))
        return text in self.heard


def linked(caplog: pytest.LogCaptureFixture, node: str) -> list[str]:
    """Return the log events about this node's link to a router."""
    return [text.split(" ")[0] for text in caplog.messages if f"linked node={node} " in text]


MODES = pytest.mark.parametrize("mode", ["peer", "client"])


@MODES
def test_a_node_that_starts_before_its_router_is_there_as_soon_as_it_is(
    site: Site, caplog: pytest.LogCaptureFixture, mode: str
) -> None:
    caplog.set_level(logging.INFO)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    lift, rmf = site.node("lift", endpoint, mode=mode), site.node("rmf", endpoint, mode=mode)
    talk = Talk(lift, rmf)
    alarm = lift.publisher(FIRE_ALARM_TRIGGER)
    with suppress(
        TransportError
    ):  # a client without a session reports an error, but keeps the message
        alarm.publish(d.Bool(True))
    rang: list[d.Bool] = []
    rmf.subscribe(FIRE_ALARM_TRIGGER, rang.append)
    wait_until(
        lambda: linked(caplog, "lift") == ["not_linked"], "the log says that no router answers"
    )
    assert not talk.arrives("nobody hears")
    site.router(endpoint)
    wait_until(lambda: talk.arrives("states are out"), "RMF hears the lift")
    wait_until(lambda: rang, "the retained message is heard")
    wait_until(lambda: len(linked(caplog, "lift")) == 2, "the log says that the router answers")
    assert linked(caplog, "lift") == ["not_linked", "linked"]
    assert rang == [d.Bool(True)]


@MODES
@pytest.mark.parametrize("ending", ["die", "leave"])
def test_a_router_that_is_lost_and_comes_back_finds_states_and_what_was_retained(
    site: Site, caplog: pytest.LogCaptureFixture, mode: str, ending: str
) -> None:
    caplog.set_level(logging.INFO)
    router = site.router()
    lift = site.node("lift", router.endpoint, mode=mode)
    rmf = site.node("rmf", router.endpoint, mode=mode)
    talk = Talk(lift, rmf)
    alarm = lift.publisher(FIRE_ALARM_TRIGGER)
    alarm.publish(d.Bool(True))
    wait_until(lambda: talk.arrives("before"), "RMF hears the lift")
    getattr(router, ending)()
    wait_until(lambda: linked(caplog, "lift") == ["linked", "not_linked"], "the loss is noted")
    assert not talk.arrives("meanwhile") or mode == "peer"
    router.start()
    wait_until(lambda: talk.arrives("after"), "RMF hears the lift again")
    wait_until(lambda: len(linked(caplog, "lift")) == 3, "the return is noted")
    late = site.node("late", router.endpoint, mode=mode)
    rang: list[d.Bool] = []
    late.subscribe(FIRE_ALARM_TRIGGER, rang.append)
    wait_until(lambda: rang, "a node that comes late hears the retained message")
    assert rang == [d.Bool(True)]
    assert linked(caplog, "lift") == ["linked", "not_linked", "linked"]


def test_the_fault_of_a_lost_router_does_not_name_the_reason_of_an_earlier_one(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    lift = site.node("lift", endpoint, mode="client")
    wait_until(lambda: linked(caplog, "lift") == ["not_linked"], "no router answers")
    ((_, at_first),) = lift.faults()
    router = site.router(endpoint)
    wait_until(lambda: linked(caplog, "lift")[1:] == ["linked"], "the router answers")
    router.die()
    wait_until(lambda: len(linked(caplog, "lift")) == 3, "the loss is noted")
    assert at_first != zenoh_transport.NO_ROUTER
    assert lift.faults() == [("NO_ROUTER", zenoh_transport.NO_ROUTER)]


def test_with_two_routers_each_message_comes_once_and_one_of_them_is_enough(site: Site) -> None:
    first = site.router()
    second = site.router(connect__endpoints=[first.endpoint])
    both = (first.endpoint, second.endpoint)
    talk = Talk(site.node("lift", *both), site.node("rmf", *both[::-1]))
    far = site.node("far", second.endpoint, mode="client")
    heard: list[str] = []
    far.subscribe(LIFT_STATES, lambda state: heard.append(state.lift_name))
    wait_until(lambda: talk.arrives("found") and "found" in heard, "both hear the lift")
    counted = [str(number) for number in range(50)]
    for text in counted:
        talk.publisher.publish(d.LiftState(lift_name=text))
    wait_until(lambda: talk.arrives("last") and "last" in heard, "all messages have arrived")
    assert [text for text in talk.heard if text.isdigit()] == counted
    assert [text for text in heard if text.isdigit()] == counted
    first.die()
    wait_until(lambda: talk.arrives("one of two") and "one of two" in heard, "one router is enough")


class Machine:
    """The network addresses of a machine, as the test sets them."""

    def __init__(self) -> None:
        self.addresses: addresses.Addresses = frozenset({(2, "10.0.0.7")})


def test_a_node_on_zenoh_joins_another_address_and_what_was_retained_goes_out_again(
    site: Site, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    machine = Machine()
    monkeypatch.setattr(addresses, "addresses", lambda: machine.addresses)
    router = site.router()
    # Our code does not count 0.0.0.0 as loopback, so the node follows the machine's addresses. The
    # kernel sends packets for 0.0.0.0 to this machine.
    anywhere = router.endpoint.replace("127.0.0.1", "0.0.0.0")
    lift = site.node("lift", anywhere)
    rmf = site.node("rmf", router.endpoint, mode="client")
    talk = Talk(lift, rmf)
    back: list[str] = []
    lift.subscribe(LIFT_STATES, lambda state: back.append(state.lift_name), others_only=True)
    alarm = lift.publisher(FIRE_ALARM_TRIGGER)
    alarm.publish(d.Bool(True))
    wait_until(lambda: talk.arrives("before"), "RMF hears the lift")
    requests, asked = lift.publisher(LIFT_REQUESTS), list[str]()
    rmf.subscribe(LIFT_REQUESTS, lambda request: asked.append(request.session_id))
    ended = d.LiftRequest(session_id="a ride that ends")
    wait_until(lambda: asked or peer.sent(requests, ended), "a request is heard")
    requests.publish(d.LiftRequest(session_id="the last one"))
    wait_until(lambda: asked[-1] == "the last one", "all requests so far are heard")
    heard = len(asked)
    machine.addresses = frozenset({(2, "10.0.0.8")})
    wait_until(
        lambda: "network addresses=10.0.0.8" in caplog.messages, "the new address is noticed"
    )
    wait_until(lambda: talk.arrives("after"), "RMF hears the lift again")
    new = d.LiftRequest(session_id="a new ride")
    wait_until(lambda: new.session_id in asked or peer.sent(requests, new), "a request is heard")
    assert set(asked[heard:]) == {"a new ride"}
    rang: list[d.Bool] = []
    site.node("late", router.endpoint, mode="client").subscribe(FIRE_ALARM_TRIGGER, rang.append)
    wait_until(lambda: rang, "a node that comes late hears the retained message")
    other, state = rmf.publisher(LIFT_STATES), d.LiftState(lift_name="to the lift")
    wait_until(lambda: back or peer.sent(other, state), "the lift hears RMF")
    assert set(back) == {"to the lift"}
    assert rang == [d.Bool(True)]


def test_nobody_of_one_domain_is_heard_in_another(site: Site) -> None:
    router = site.router()
    zenoh = Zenoh(connect=(router.endpoint,))
    elsewhere = ZenohTransport("elsewhere", DOMAIN + 1, loopback=False, settings=zenoh)
    site.nodes.append(elsewhere)
    talk = Talk(site.node("lift", router.endpoint), site.node("rmf", router.endpoint))
    stranger = elsewhere.publisher(LIFT_STATES)
    stranger.publish(d.LiftState(lift_name="elsewhere"))
    wait_until(lambda: talk.arrives("here"), "RMF hears the lift")
    assert set(talk.heard) == {"here"}
    wait_until(
        lambda: talk.publisher.matched() == 1, "the lift's node learns of RMF's subscription"
    )
    assert stranger.matched() == 0


# --- credentials --------------------------------------------------------------------------------


class Papers:
    """The files of an authority, and the certificates of a router and of a daemon."""

    def __init__(self, directory: Path) -> None:
        authority = trustme.CA()
        self.ca = self._write(directory / "ca.pem", authority.cert_pem.bytes())
        for name in ("router", "daemon"):
            issued = authority.issue_cert("localhost", "127.0.0.1")
            chain = b"".join(part.bytes() for part in issued.cert_chain_pems)
            self._write(directory / f"{name}.pem", chain)
            self._write(directory / f"{name}.key", issued.private_key_pem.bytes())
        self.directory = directory

    def file(self, name: str) -> str:
        """Return the path of the file with this name."""
        return str(self.directory / name)

    @staticmethod
    def _write(path: Path, content: bytes) -> str:
        path.write_bytes(content)
        path.chmod(0o600)
        return str(path)


@pytest.fixture(scope="module")
def papers(tmp_path_factory: pytest.TempPathFactory) -> Papers:
    return Papers(tmp_path_factory.mktemp("papers"))


def guarded(site: Site, papers: Papers) -> Router:
    """Return a router that demands a certificate of every node."""
    return site.router(
        f"tls/localhost:{free_port()}",
        transport__link__tls__root_ca_certificate=papers.ca,
        transport__link__tls__listen_certificate=papers.file("router.pem"),
        transport__link__tls__listen_private_key=papers.file("router.key"),
        transport__link__tls__enable_mtls=True,
    )


def test_with_its_certificate_a_node_comes_in_and_without_it_does_not(
    site: Site, papers: Papers, caplog: pytest.LogCaptureFixture
) -> None:
    router = guarded(site, papers)
    tls = ZenohTls(
        ca=papers.ca,
        certificate=papers.file("daemon.pem"),
        private_key=papers.file("daemon.key"),
    )
    talk = Talk(
        site.node("lift", router.endpoint, tls=tls),
        site.node("rmf", router.endpoint, tls=tls, mode="client"),
    )
    wait_until(lambda: talk.arrives("encrypted"), "RMF hears the lift")
    site.node("stranger", router.endpoint, tls=ZenohTls(ca=papers.ca))
    wait_until(lambda: linked(caplog, "stranger"), "the log says that the stranger has no link")
    assert linked(caplog, "stranger") == ["not_linked"]


def test_with_its_password_a_node_comes_in_and_with_another_does_not(
    site: Site, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "users").write_text("lift:open sesame\n")
    for name, password in {"right": "open-sesame", "wrong": "guessed"}.items():
        (tmp_path / name).write_text(password + "\n")
        (tmp_path / name).chmod(0o600)
    (tmp_path / "users").write_text("lift:open-sesame\n")
    router = site.router(
        transport__auth__usrpwd__dictionary_file=str(tmp_path / "users"),
        transport__auth__usrpwd__user="router",
        transport__auth__usrpwd__password="x",
    )
    known = {"user": "lift", "mode": "client"}
    right, wrong = str(tmp_path / "right"), str(tmp_path / "wrong")
    talk = Talk(
        site.node("lift", router.endpoint, password_file=right, **known),
        site.node("rmf", router.endpoint, password_file=right, **known),
    )
    wait_until(lambda: talk.arrives("known"), "RMF hears the lift")
    site.node("liar", router.endpoint, password_file=wrong, **known)
    site.node("stranger", router.endpoint, mode="client")
    for name in ("liar", "stranger"):
        logged = partial(linked, caplog, name)
        wait_until(logged, f"the log says that the {name} has no link")
        assert linked(caplog, name) == ["not_linked"]


@pytest.mark.parametrize("secret", ["password_file", "private_key"])
def test_a_secret_that_others_can_read_is_refused(
    papers: Papers, tmp_path: Path, secret: str
) -> None:
    file = tmp_path / "secret"
    file.write_text("open-sesame\n")
    file.chmod(0o640)
    if secret == "password_file":
        zenoh = Zenoh(user="lift", password_file=str(file))
    else:
        zenoh = Zenoh(tls=ZenohTls(certificate=papers.file("daemon.pem"), private_key=str(file)))
    with pytest.raises(TransportError, match=f"{secret} .* is open to other users: chmod 600"):
        ZenohTransport("lift", DOMAIN, loopback=False, settings=zenoh)


def test_a_file_that_is_not_there_is_named(papers: Papers) -> None:
    for zenoh in (
        Zenoh(user="lift", password_file="/nowhere/password"),
        Zenoh(tls=ZenohTls(ca="/nowhere/ca.pem")),
        Zenoh(tls=ZenohTls(certificate=papers.ca, private_key="/nowhere/key")),
    ):
        with pytest.raises(TransportError, match=r"/nowhere/.* cannot be read: No such file"):
            ZenohTransport("lift", DOMAIN, loopback=False, settings=zenoh)


def test_an_address_that_cannot_be_listened_on_is_an_error() -> None:
    zenoh = Zenoh(mode="peer", listen=("tcp/192.0.2.1:7447",))
    with pytest.raises(TransportError, match="cannot open a zenoh session"):
        ZenohTransport("lift", DOMAIN, loopback=False, settings=zenoh)


# --- simulated devices never reach a router -----------------------------------------------------


def test_a_node_on_loopback_takes_no_notice_of_the_settings_and_opens_no_other_address(
    domain: int,
) -> None:
    zenoh = Zenoh(connect=("tcp/10.0.0.5:7447",), listen=("tcp/0.0.0.0:0",))
    node = ZenohTransport("simulated", domain, loopback=True, settings=zenoh)
    try:
        assert {address for address, _ in listening(os.getpid())} == {"0100007F"}
    finally:
        node.close()
    for config in zenoh_config.on_loopback(domain):
        for key in ("connect/endpoints", "listen/endpoints"):
            endpoints = config.get(key, [])
            assert isinstance(endpoints, list)
            assert all(map(zenoh_config.is_local, endpoints))
        assert config["listen/endpoints"]
        assert config["scouting/multicast/enabled"] is False


def listening(pid: int) -> set[tuple[str, str]]:
    """Return the (address, port) of each TCP socket on which a process listens, in hexadecimal
    digits."""
    inodes = set()
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(OSError):
            inodes.add(str(descriptor.readlink()))
    rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return {
        (row[1].split(":")[0], row[1].split(":")[1])
        for row in rows
        if row[3] == "0A" and f"socket:[{row[9]}]" in inodes
    }


def test_a_router_drives_a_node_that_must_stay_here_off_the_graph_until_it_has_gone(
    site: Site, domain: int, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level(logging.INFO)
    monkeypatch.setattr(zenoh_alone, "GONE_AFTER_S", 0.0)
    lift, rmf = (ZenohTransport(name, domain, loopback=True) for name in ("lift", "rmf"))
    site.nodes += [lift, rmf]
    talk, alarm = Talk(lift, rmf), lift.publisher(FIRE_ALARM_TRIGGER)
    asked: list[d.LiftRequest] = []
    asks, hears = rmf.publisher(LIFT_REQUESTS), lift.subscribe(LIFT_REQUESTS, asked.append)
    wait_until(lambda: talk.arrives("before") and hears.matched() == 1, "RMF and lift meet")
    assert lift.faults() == []

    router = site.router(connect__endpoints=[meeting(domain)])
    wait_until(
        lambda: [code for code, _ in lift.faults()] == ["ROUTER_ON_LOOPBACK"],
        "the lift's node has left because of the router",
    )
    assert (talk.publisher.matched(), hears.matched(), lift.lives) == (0, 0, True)
    with pytest.raises(TransportError, match="the node is not on the graph"):
        talk.publisher.publish(d.LiftState(lift_name="away"))
    with pytest.raises(TransportError):
        alarm.publish(d.Bool(True))
    wait_until(lambda: asks.matched() == 0, "RMF knows that the lift has gone")
    asks.publish(d.LiftRequest(session_id="unheard"))

    router.leave()
    rang: list[d.Bool] = []
    rmf.subscribe(FIRE_ALARM_TRIGGER, rang.append)
    wait_until(lambda: talk.arrives("after") and rang, "RMF hears the lift again, and its alarm")
    wait_until(lambda: hears.matched() == 1, "the lift knows of RMF")
    wait_until(
        lambda: asked or peer.sent(asks, d.LiftRequest(session_id="heard")),
        "the lift hears RMF's request",
    )
    assert {request.session_id for request in asked} == {"heard"}
    assert "away" not in talk.heard
    assert lift.faults() == []
    said = [text.split(" ")[0] for text in caplog.messages if "node=lift" in text]
    assert said == ["left_graph", "back_on_graph"]


def test_a_node_stays_away_while_a_router_is_there_and_for_ten_seconds_after_it_was_last_seen() -> (
    None
):
    alone = zenoh_alone.Alone()
    seen = [alone.away(router, now) for router, now in [(False, 5.0), (True, 6.0), (True, 60.0)]]
    assert seen == [False, True, True]
    assert [alone.away(False, now) for now in (60.1, 69.9)] == [True, True]
    assert alone.away(True, 69.95)
    assert [alone.away(False, now) for now in (79.9, 80.0, 90.0)] == [True, False, False]


def test_a_node_whose_router_does_not_answer_says_so_as_a_fault(site: Site) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    lift = site.node("lift", endpoint, mode="client")
    wait_until(
        lambda: [code for code, _ in lift.faults()] == ["NO_ROUTER"],
        "the missing router is a fault",
    )
    site.router(endpoint)
    wait_until(lambda: lift.faults() == [], "the fault is over")


def test_publishers_are_declared_while_the_node_waits_for_a_silent_router(
    join_zenoh: Join, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scan that waited for an attempt of 10 s would end by the watchdog."""
    node = join_zenoh("node")
    opens, answers = threading.Event(), threading.Event()

    def opened(ways: Any) -> Any:
        opens.set()
        answers.wait()
        return session.opened(ways)

    monkeypatch.setattr(zenoh_transport, "opened", opened)
    assert isinstance(node, ZenohTransport)
    node._orders.put(node._join_anew)
    wait_until(opens.is_set, "the node tries to join again")
    declares = threading.Thread(target=node.publisher, args=(LIFT_STATES,))
    declares.start()
    wait_until(lambda: not declares.is_alive(), "the publisher is declared")
    answers.set()
    heard = join_zenoh("other").subscribe(LIFT_STATES, print)
    wait_until(lambda: heard.matched() == 1, "the publisher is on the graph")

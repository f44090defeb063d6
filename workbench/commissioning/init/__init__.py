"""Draft a commented YAML for `rmf-bridge init`. All functions are pure: their input is answers, and
their output is text.

`points.py` gives each signal a pin or an address.
"""

import re
from collections.abc import Iterator
from typing import Final

import msgspec

from drivers.charger import dry_contact as charger
from drivers.dispenser import dry_contact as dispenser
from drivers.door import dry_contact as door
from drivers.lift import wiring
from workbench.commissioning.init import gateway
from workbench.commissioning.init.answers import LIFT_INPUTS, DraftAnswers, Impossible
from workbench.commissioning.init.points import FreePoints, points_for
from workbench.commissioning.reference import meaning

DRIVERS: Final = {"http": "http", "can": "canopen", "gateway": "register"}
"""Wiring -> driver. Any other wiring uses the driver `dry_contact`."""
WIRINGS: Final = {
    "lift": ("gpio", "modbus", "rs485", "gateway", "http", "mqtt"),
    "door": ("modbus", "rs485", "gpio", "http", "mqtt", "gateway"),
    "charger": ("http", "can", "modbus", "rs485", "gpio", "mqtt"),
    "alarm": ("gpio", "modbus", "rs485", "http"),
    "dispenser": ("gpio", "modbus", "rs485", "http"),
    "ingestor": ("gpio", "modbus", "rs485", "http"),
    "fleet": ("http", "mqtt"),
}
BUSES: Final = {
    "gpio": "  header: {{type: gpio}}",
    "modbus": "  module: {{type: modbus, tcp: {{host: {address}, port: 502}}}}",
    "rs485": "  line:\n    type: modbus\n"
    "    serial: {{port: {address}, baudrate: 19200, parity: none, stopbits: 1}}",
    "http": "  web: {{type: http, api_base: {address}}}",
    "can": "  can: {{type: can, socketcan: {address}}}",
    "mqtt": "  building:\n    type: mqtt\n    host: {address}",
}
ADDRESSES: Final = {
    "modbus": "192.168.1.50",
    "rs485": "/dev/ttyUSB0",
    "http": "192.168.1.60",
    "can": "can0",
    "mqtt": "192.168.1.10",
    "gateway": "192.168.1.60",
}
"""Wiring -> default address. A GPIO header has no address."""
HAZARDS: Final = LIFT_INPUTS[:7]
DOOR_ENDS: Final = {"door_opened": "open", "door_closed": "closed"}
BOOLEANS: Final = ("y", "n", "yes", "no", "on", "off", "true", "false", "null")
SHELLY: Final = """\
    # A Shelly of the second generation. Its own timer (toggle_after) releases the door when the
    # network is gone. The daemon restarts this timer in each scan.
    limits: {stale_after_s: 4}
    state_path: /rpc/Shelly.GetStatus
    inputs:                          # names with dots between them
      opened: {field: "input:0.state"}
      closed: {field: "input:1.state"}
    held: {field: "switch:0.output"}
    hold: {path: "/rpc/Switch.Set?id=0&on=true&toggle_after=10", method: GET}
    release: {path: "/rpc/Switch.Set?id=0&on=false", method: GET}
    switches_off_after_s: 10         # the same number as toggle_after"""
CHARGER_HTTP: Final = """\
    # The meanings of the maker's state numbers: ask the maker. An unlisted number is an error.
    codes:
      idle: [0]
      handshake: [1, 2, 3, 4]
      charging: [5]
      stopping: [6]                  # current still flows
      released: [7]
      error: [8, 255]"""
WORKCELL_HTTP: Final = """\
    limits: {stale_after_s: 4}
    state_path: /state
    inputs:                          # names with dots between them
      done: {field: phase, when: [done]}
      busy: {field: phase, when: [moving]}
      ready: {field: phase, when: [idle]}
      fault: {field: error}
    start: {path: /start, body: '{"job": "$guid", "type": "$type_guid"}'}
    stop: {path: /stop}"""
LIFT_HTTP: Final = """\
    # The fields and requests of the lift's gateway. When the network is gone, the gateway's own timers
    # must end AGV mode and release the door. The daemon restarts these timers in each scan.
    floors: [FLOORS]                 # RMF's names, from the lowest floor up
    limits: {stale_after_s: 3}
    api:
      state_path: /lift
      state:                         # names with dots between them; an unlisted value is a fault
        floor: {field: car.floor, values: {NUMBERS}, between_floors: [-1]}
        motion: {field: car.moves, stopped: [none], up: [up], down: [down]}
        door: {field: car.door, open: [open], closed: [closed], moving: [moving]}
        service: {field: mode, normal: [normal], agv_mode: [robot]}
        fire_alarm: {field: fire}
      commands:
        agv_mode_request:
          ask: {path: /robot, body: '{"on": true, "seconds": 10}'}
          release: {path: /robot, body: '{"on": false}'}
          shown: {field: outputs.robot}
          switches_off_after_s: 10   # the same number as in `ask`
        door_open:
          ask: {path: /door, body: '{"hold": true, "seconds": 10}'}
          release: {path: /door, body: '{"hold": false}'}
          shown: {field: outputs.door}
          switches_off_after_s: 10
        call: {path: /call, body: '{"floor": "{level}"}'}
        cancel: {path: /cancel}"""
CHARGER_CANOPEN: Final = """\
    node: 10                         # the receiver's node id
    heartbeat_timeout_s: 0.5         # a heartbeat comes each 0.1 s
    on_death: stop                   # stop or keep a running charge when the daemon dies"""


def draft(answers: DraftAnswers) -> str:
    """Return the whole file. Raises Impossible for contradictory answers."""
    if answers.wiring not in WIRINGS[answers.kind]:
        raise Impossible(
            f"a {answers.kind} cannot have the wiring {answers.wiring}; choose one of:"
            f" {', '.join(WIRINGS[answers.kind])}"
        )
    address = answers.address or ADDRESSES.get(answers.wiring, "")
    points = points_for(answers)
    fleet = answers.kind == "fleet"
    section = [f"{answers.kind}s:", f"  {quoted(answers.name)}:"]
    section += [] if fleet else SECTIONS[answers.kind](answers, points)
    driver = DRIVERS.get(answers.wiring, "vda5050" if fleet else "dry_contact")
    lines = [
        f"# {answers.name}: compare every point with the wires, then `rmf-bridge check` this file.",
        "# docs/reference/configuration.md lists every key, docs/how-to/wire.md shows how wires fail.",
        f"kind: {answers.kind}",
        f"driver: {driver}",
        "",
        "rmf:",
        "  transport: auto        # rclpy where ROS 2 is installed, else DDS or zenoh without ROS",
        f"  domain_id: {answers.domain_id}           # RMF's ROS_DOMAIN_ID",
        "",
        "buses:",
        BUSES[_bus(answers.wiring, address)].format(address=quoted(address)),
        *(["", "robots:", *_robots(answers)] if fleet else [*points.listed(), "", *section]),
    ]
    return "\n".join(lines) + "\n"


def _bus(wiring: str, address: str) -> str:
    """Return the bus as a key of BUSES. If a gateway's address is a device file, the gateway is on a
    serial line."""
    if wiring != "gateway":
        return wiring
    return "rs485" if address.startswith("/") else "modbus"


def _lift(answers: DraftAnswers, points: FreePoints) -> Iterator[str]:
    """Yield the lines below the name of a lift. The lift is on contacts or on a gateway."""
    floors = [quoted(floor) for floor in answers.floors]
    if len(floors) < 2 or len(set(floors)) < len(floors):
        raise Impossible(f"a lift has at least two floors, each name once, not {', '.join(floors)}")
    if answers.wiring == "gateway":
        yield from gateway.lift(answers, floors)
        return
    if answers.wiring == "http":
        numbers = ", ".join(f"{floor}: {number}" for number, floor in enumerate(floors))
        api = LIFT_HTTP.replace("FLOORS", ", ".join(floors)).replace("NUMBERS", numbers)
        yield from api.splitlines()
        return
    calls = [
        f"      {floor}: {{{points.relay()}}}" for floor in floors
    ]  # floors come first, because they need the most pins
    request, hold = points.relay(), points.relay()
    yield f"    floors: [{', '.join(floors)}]        # RMF's names, from the lowest floor up"
    yield "    inputs:"
    yield "      # Alarm loops are closed while all is well: an open contact or a cut wire is an alarm."
    for signal in LIFT_INPUTS:
        if signal in answers.signals:
            yield f"      {_input(signal, answers, points)}   {_said(wiring.LiftInputWiring, signal)}"
    yield from _floor_code(answers, floors, points)
    yield "    outputs:"
    if "agv_mode" in answers.signals:
        said = _said(wiring.LiftOutputWiring, "agv_mode_request")
        yield f"      agv_mode_request: {{{request}}}   {said}"
    yield f"      door_open: {{{hold}}}   {_said(wiring.LiftOutputWiring, 'door_open')}"
    yield "    calls:                     # a car call for each floor"
    yield from calls


def _input(signal: str, answers: DraftAnswers, points: FreePoints) -> str:
    if signal in HAZARDS:
        return f"{signal}: {{{points.loop()}}}"
    if signal in DOOR_ENDS and not set(DOOR_ENDS) <= set(answers.signals):
        return f"door: {{{points.contact()}, proves: {DOOR_ENDS[signal]}}}"
    return f"{signal}: {{{points.contact()}}}"


def _floor_code(answers: DraftAnswers, floors: list[str], points: FreePoints) -> Iterator[str]:
    yield "    floor_code:                # lines for the car's floor"
    yield f"      encoding: {answers.encoding}"
    if answers.encoding == "one_hot":
        yield "      lines:                   # one for each floor; between floors no line is on"
        for floor in floors:
            yield f"        {floor}: {{{points.contact()}}}"
        return
    yield "      bits:                    # least significant first"
    for _ in range(len(floors).bit_length()):
        yield f"        - {{{points.contact()}}}"
    yield "      # The parity line shows a broken line. No such line: delete it; `check` then warns."
    yield f"      parity: {{{points.contact()}, total: even}}"
    codes = ", ".join(f"{number}: {floor}" for number, floor in enumerate(floors, start=1))
    yield f"      codes: {{{codes}}}"


def _door(answers: DraftAnswers, points: FreePoints) -> Iterator[str]:
    """Yield the lines below the name of a door. The door is on contacts, an HTTP relay or registers."""
    if answers.wiring == "http":
        yield from SHELLY.splitlines()
        return
    if answers.wiring == "gateway":
        yield from gateway.door(answers)
        return
    yield "    inputs:"
    for end in ("opened", "closed"):
        yield f"      {end}: {{{points.contact()}}}   {_said(door.DoorInputWiring, end)}"
    yield "    outputs:"
    yield f"      hold_open: {{{points.relay()}}}   {_said(door.DoorOutputWiring, 'hold_open')}"


def _charger(answers: DraftAnswers, points: FreePoints) -> Iterator[str]:
    """Yield the lines below the name of a charger. The charger is on HTTP, CANopen or contacts."""
    if answers.wiring in ("http", "can"):
        yield from (CHARGER_HTTP if answers.wiring == "http" else CHARGER_CANOPEN).splitlines()
        return
    yield "    inputs:"
    for signal in ("charging", "ready"):
        yield f"      {signal}: {{{points.contact()}}}   {_said(charger.ChargerInputWiring, signal)}"
    yield f"      fault: {{{points.loop()}}}   # opens at a fault; a cut wire reads as a fault too"
    yield "    outputs:"
    yield f"      enable: {{{points.relay()}}}   {_said(charger.ChargerOutputWiring, 'enable')}"


def _alarm(answers: DraftAnswers, points: FreePoints) -> Iterator[str]:
    """Yield the lines below the name of a fire panel."""
    yield "    alarm: fire_alarm_trigger  # every fleet; for some fleets: emergency_signal (Kilted)"
    yield "    silent_alarm_after_s: 60   # a broken cable stops the robots after this time"
    if answers.wiring == "http":
        yield "    limits: {stale_after_s: 5}"
        yield "    state_path: /state"
    yield "    sources:                   # an alarm opens the contact, and so does a cut wire"
    for source in ("fire_panel", "code_blue"):
        field = f"field: inputs.{source}, when: [false]"
        yield f"      {source}: {{{field if answers.wiring == 'http' else points.loop()}}}"


def _workcell(answers: DraftAnswers, points: FreePoints) -> Iterator[str]:
    """Yield the lines below the name of a dispenser or ingestor."""
    yield "    items:"
    yield "      box: {}                  # the type_guid in RMF's request"
    if answers.wiring == "http":
        yield from WORKCELL_HTTP.splitlines()
        return
    yield "    pulse_s: 0.5               # how long the output `start` is on"
    yield "    inputs:"
    for signal in ("done", "busy", "ready"):
        yield f"      {signal}: {{{points.contact()}}}   {_said(dispenser.WorkcellInputWiring, signal)}"
    yield f"      fault: {{{points.loop()}}}   # opens at a fault; a cut wire reads as a fault too"
    yield "    outputs:"
    yield f"      start: {{{points.relay()}}}   {_said(dispenser.WorkcellOutputWiring, 'start')}"


def _robots(answers: DraftAnswers) -> Iterator[str]:
    """Yield the lines of all robots, and the lines that name RMF's files of the fleet."""
    for number, name in enumerate(answers.name.split(","), start=1):
        yield f"  {quoted(name.strip())}:"
        if answers.wiring == "http":
            yield "    profile: rmf-demos         # RMF's tutorial; for other managers, write `api`"
        else:
            yield f"    # The topics begin with uagv/v2/acme/{number:04}."
            yield "    manufacturer: acme"
            yield f'    known_as: "{number:04}"           # the serial number'
    yield ""
    yield "fleet:                         # RMF's own files, unchanged"
    yield f"  config: {quoted(answers.fleet_config)}"
    yield f"  graph: {quoted(answers.graph)}"


def _said(struct: type, key: str) -> str:
    """Return the YAML comment for a key. The comment is the first clause of the key's description."""
    return f"# {re.split('[;:.]', meaning(struct, key))[0]}"


def quoted(text: str) -> str:
    """Quote a text, so that YAML never reads the text as a number or boolean."""
    plain = text[:1].isalpha() and text.replace("_", "a").replace("-", "a").isalnum()
    if plain and text.lower() not in BOOLEANS:
        return text
    return msgspec.json.encode(text).decode()


SECTIONS: Final = {
    "lift": _lift,
    "door": _door,
    "charger": _charger,
    "alarm": _alarm,
    "dispenser": _workcell,
    "ingestor": _workcell,
}

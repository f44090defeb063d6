"""A file with every type of mistake. The loader reports all mistakes at once, in the order of the
file."""

from pathlib import Path

from tests.settings.reading import problems_of

BAD = """\
# A gate as nobody should write it.
kind: gate
driver: contact
rmf: {transport: ddss, domain_id: 017, topics: {gate_states: no}}
buses:
  header: {type: pins, chp: 1, chip: 1.0}
  spare: {type: modul}
  box: {type: module, host: 192.168.1.50, port: 70000}
gates:
  north:
    bus: header
    lanes: [in, 2, 1:30, ~, 1e3]
    inputs:
      opened: {point: 17, active: hgh, pul: up}
      closed: {point: A1, active: low, debounce_s: 20}
      closed: {point: A2, active: low}
      other: {point: 1A, active: high, debounce_s: 20 ms}
      last: {point: A4, active: high}
    outputs:
      hold: {point: A1}
    codes: {1: in, 0x1: in, 01: out, "3": out, 99: in}
    limits: {open_s: .nan, tries: 0, loud: yes, label: A, gain: "1", close_s:}
  south:
    bus: boxx
    lanes: {a: {side: lft, heights: [1, 9, x]}, b: , <<: {d: {}}}
    inputs: {o: {point: A3, active: !!str high, pull: up}}
  west: {lanes: [], inputs: [], acept_unsafe: {o: because}}
  no: 3
extra: 1
"""
FOUND = """\
4:18: 'transport' is 'ddss': write auto, dds, ros2 or zenoh (did you mean 'dds'?)
4:35: 'domain_id' is written 017, which YAML may read as the number 15: \
write a whole number from 0 to 232 plainly
4:62: 'gate_states' is written no, which YAML may read as false: \
if the text is meant, write "no" in quotes
6:24: unknown key 'chp': did you mean 'chip'? known here: type, chip
6:38: 'chip' is the number 1.0: write a whole number
7:17: 'type' is 'modul': write module or pins (did you mean 'module'?)
8:49: 'port' is 70000: write a whole number from 1 to 65535
12:17: item 2 of 'lanes' is the number 2: if the text is meant, write "2" in quotes
12:20: item 3 of 'lanes' is written 1:30, which YAML may read as the number 90: \
if the text is meant, write "1:30" in quotes
12:26: item 4 of 'lanes' is written ~, which YAML may read as nothing: \
if the text is meant, write "~" in quotes
12:29: item 5 of 'lanes' is the number 1e3: if the text is meant, write "1e3" in quotes
14:23: '17' is not a pin: write A1
14:35: 'active' is 'hgh': write high or low (did you mean 'high'?)
14:40: unknown key 'pul': did you mean 'pull'? known here: point, active, pull, debounce_s, bus
15:52: 'debounce_s' is 20: write a number from 0 to 10 s; for 20 milliseconds write 0.02
16:7: the key 'closed' is already on line 15: delete one of the two
17:22: 1A (A1) is used by north inputs.closed on line 15: north inputs.other needs a point of its own
17:52: 'debounce_s' is written 20 ms: write the number alone, a number from 0 to 10 s
18:7: 'last': pull is missing
20:7: 'hold' needs 'active': high or low
20:21: A1 is used by north inputs.closed on line 15: north outputs.hold needs a point of its own
21:20: the key '0x1' is already on line 21: delete one of the two
21:29: this key is written 01, which YAML may read as the number 1: \
write a whole number from 0 to 15 plainly
21:38: this key is the text "3": write a whole number from 0 to 15, without quotes
21:48: this key is 99: write a whole number from 0 to 15
22:22: 'open_s' is not a number (.nan): write a number from 0.1 to 60 s
22:35: 'tries' is 0: write a whole number of at least 1
22:44: 'loud' is written yes, which YAML versions read differently: write true
22:56: 'label' is 'A': write a small word
22:65: 'gain' is the text "1": write a number, without quotes
22:70: 'close_s' has no value: write a number from 0 to 86400 s
24:10: unknown bus 'boxx': did you mean 'box'? known here: header, spare, box
25:23: 'side' is 'lft': write left or right (did you mean 'left'?)
25:41: item 2 of 'heights' is 9: write a number above 0 and below 5 m
25:44: item 3 of 'heights' is the text 'x': write a number above 0 and below 5 m
25:49: 'b' has no value: write a mapping (key: value)
25:54: merge keys ('<<') are not accepted: write the keys out
26:37: a tag ('!...') is not accepted: delete it, or quote the text
27:3: 'west' needs 'bus': header, spare or box
27:21: 'inputs' is a list: write a mapping (key: value)
27:33: unknown key 'acept_unsafe': did you mean 'accept_unsafe'? known here: \
bus, driver, accept_unsafe, lanes, inputs, outputs, bits, codes, limits
28:3: this name is written no, which YAML may read as false: \
if the text is meant, write "no" in quotes
28:7: 'no' is the number 3: write a mapping (key: value)
29:1: unknown key 'extra': known here: kind, driver, rmf, recording, buses, gates
"""


def test_all_independent_problems_of_a_file_are_reported_at_once(file: Path) -> None:
    assert problems_of(file, BAD) == FOUND.splitlines()

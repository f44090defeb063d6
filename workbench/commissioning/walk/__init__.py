"""`rmf-bridge walk`: every input and output of a device tried with the electrician, and signed.

`core.py` decides (pure), `steps.py` says what can be tried of each kind, `bench.py` scans the device,
`tap.py` shows the levels of its contacts, `screen.py` draws, `signed.py` writes the record.
"""

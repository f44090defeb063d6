"""`rmf-bridge walk`: test every input and output of a device with the electrician, and sign the record.

`core.py` decides and is pure. `steps.py` lists the outputs to test. `bench.py` scans the device.
`tap.py` shows the levels of the device's contacts. `screen.py` draws. `signed.py` writes the record.
"""

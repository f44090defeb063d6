"""Twelve troubles on a whole site, each explained twice: live, and from the file of our recorder.

expected.toml   the verdicts, written before the code by somebody who had not seen it
verdicts.py     reads them, and compares a screen with one of them
site.py         the site: daemons with their rings, RMF's supervisors, one fleet, the recorder
fleet.py        the fleet's adapter
asked.py        `rmf-bridge` as a person types it, in the site's time
stories.py      each trouble, by the name that it has in expected.toml
"""

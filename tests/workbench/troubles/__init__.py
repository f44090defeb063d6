"""Twelve troubles on a whole site. `explain` explains each trouble live, and from our recorder's file.

expected.toml   the verdicts; their author wrote them before the code, and had not seen it
verdicts.py     reads the verdicts, and compares a screen with a verdict
site.py         the site: daemons with their rings, RMF's supervisors, one fleet, the recorder
fleet.py        the fleet's adapter
asked.py        `rmf-bridge` as a person types it, in the site's time
stories.py      each trouble, by its name in expected.toml
"""

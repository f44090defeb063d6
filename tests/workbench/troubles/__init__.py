"""Twelve troubles on a whole site. `explain` explains each trouble from the live graph, and from our
recorder's file.

expected.toml   the texts that `explain` should print; their author wrote them before the code, and had
                not seen the code
verdicts.py     reads expected.toml, and compares the printed text with the expected text
site.py         the site: daemons with their event files, RMF's supervisors, one fleet, the recorder
fleet.py        the fleet's adapter
asked.py        `rmf-bridge` as a person types it, in the site's time
stories.py      each trouble, by its name in expected.toml
"""

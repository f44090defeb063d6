"""Incidents of the soak test, as the recorder writes them. `python -m tests.workbench.replay.corpus`
renews them."""

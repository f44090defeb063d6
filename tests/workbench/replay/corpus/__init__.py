"""Incidents of the soak as the recorder writes them; `python -m tests.workbench.replay.corpus`
renews them."""

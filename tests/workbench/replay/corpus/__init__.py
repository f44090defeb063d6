"""Incidents of the soak test, in the form of the recorder's files.

`python -m tests.workbench.replay.corpus` writes these files again.
"""

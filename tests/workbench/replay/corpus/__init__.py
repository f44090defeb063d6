"""Incidents of a simulated day at a site, in the form of the recorder's files.

`python -m tests.workbench.replay.corpus` writes these files again.
"""

"""Explain the events at a lift, door or charger: lanes to draw, and sentences. All functions are pure.

The input is messages heard on RMF's graph (`bridges/messages/heard.py`), live or from a recording. The
notes that our daemons keep about their own devices are a second input, if a recording has them.
"""

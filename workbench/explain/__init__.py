"""Explain the events at a lift, door or charger: lanes to draw, and sentences. Pure functions.

The input: messages heard on RMF's graph (`bridges/messages/heard.py`), live or from a recording,
and, if available, the notes of one of our daemons about its own device.
"""

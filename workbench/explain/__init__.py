"""Explain the events at a device, as lanes to draw and as sentences. All functions are pure.

The first input is messages heard on RMF's graph (`bridges/messages/heard.py`), live or from a
recording. The second input is the notes that our daemons record about their own devices. Not every
recording has such notes.
"""

"""Explain the events at a device, as a picture and as sentences. The picture has lanes, which are rows
such as the door's row. All functions are pure.

The first input is messages heard on RMF's graph (`bridges/messages/heard.py`), live or from a
recording. The second input is the notes that our daemons record about their own devices. Not every
recording has such notes.
"""

"""What happened to a lift, door or charger, as lanes that are drawn and as sentences. Pure functions.

The input is what was heard on RMF's graph (`bridges/messages/heard.py`), live or from a recording,
and what one of our daemons noted of its own device, where there is that.
"""

"""Programs inside the machine. They import only the standard library, except `far_side.py`."""

"""The findings of `check` about a file: gathered once (`findings.py`), and written in three forms.

text.py      for a terminal
as_json.py   for a program
html.py      the commissioning sheet: a page for each controller, with boxes to tick
"""

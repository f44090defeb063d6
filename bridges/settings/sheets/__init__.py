"""The findings of the command `check` about a file. `findings.py` gathers the findings, and three
modules show them:

    text.py      for a terminal
    as_json.py   for a program
    html.py      the commissioning sheet: a page for each controller, with boxes to tick
"""

"""Nodes of other people's making. `right_*` and `different` are right, and not like ours; each other
file is one defect that the field knows. A node is a `Party`: it hears, is ticked, and says something.
"""

"""Nodes of other people's making. `right_*` and `different` are right, and not like ours; each class of
`wrong_*` has one defect that the field knows. A node is a `Party`: it hears, is ticked, and speaks.
"""

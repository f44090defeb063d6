"""Nodes of other makers. Each node is a `Party`: it receives messages, gets ticks, and publishes.

The nodes of `right_*` and `different` are correct, but behave differently from ours. Each class of
`wrong_*` has one defect that occurred in the field.
"""

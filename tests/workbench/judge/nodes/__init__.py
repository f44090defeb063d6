"""Nodes of other makers. The nodes of `right_*` and `different` are correct, but work otherwise than
ours. Each class of `wrong_*` has one defect that is known from the field. A node is a `Party`: it
receives messages, gets ticks, and publishes."""

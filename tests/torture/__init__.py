"""Disturbs real daemons from outside, on loopback (`make torture`); see
docs/explanation/reliability.md.
"""

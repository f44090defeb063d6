"""Tests of `judge`. A law is a rule for a node's messages. The judge applies the same laws to our
nodes, to correct nodes, and to nodes with known defects."""

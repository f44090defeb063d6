"""Tests of `judge`. The judge applies the same laws to our nodes, to correct nodes, and to nodes with
known defects."""

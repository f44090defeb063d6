"""Tests of `judge`. It applies the same laws to our nodes, to correct nodes, and to nodes with known
defects."""

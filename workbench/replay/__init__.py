"""Recordings of every kind, read and decided again."""

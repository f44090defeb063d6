"""The service of a fleet. On one side is RMF's adapter or a stand-in, and on the other side are
robots."""

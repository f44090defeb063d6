"""The ways to RMF's graph: one that the YAML names is opened, with the same messages on each."""

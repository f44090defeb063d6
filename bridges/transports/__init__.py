"""The ways to RMF's graph. The YAML selects one; all carry the same messages."""

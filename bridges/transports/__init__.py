"""The transports to RMF's graph. The YAML selects a transport; all carry the same messages."""

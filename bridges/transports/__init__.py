"""The transports to RMF's graph. The YAML selects a transport. All transports carry the same
messages."""

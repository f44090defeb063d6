"""RMF's graph for people: join it, watch it, and send requests."""

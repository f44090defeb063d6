"""RMF's graph, for the commands that people use: join it, watch it, and send requests."""

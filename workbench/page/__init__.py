"""The page: a graphical view of RMF's graph, in its own process."""

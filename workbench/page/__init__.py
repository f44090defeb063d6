"""The page: what is on RMF's graph, for people who look rather than read. A process of its own."""

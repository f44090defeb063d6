"""RMF's graph as a person meets it: joined, watched, and asked for something."""

"""A web page that draws RMF's graph. The page runs in a separate process."""

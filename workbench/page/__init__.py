"""A web page that draws RMF's graph, in a separate process."""

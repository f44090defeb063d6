"""The laws that RMF needs a node to keep, and a judge. The judge tells whether a node on the graph
keeps the laws."""

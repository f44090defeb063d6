"""RMF's contract as laws, and a judge. The judge tells whether a node on the graph keeps the laws."""

"""RMF's contract as laws, and whether a lift, door or charger node on the graph keeps them."""

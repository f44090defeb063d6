"""RMF's contract as laws; judge whether a lift, door or charger node on the graph keeps them."""

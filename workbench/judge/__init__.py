"""RMF's contract as laws, and a judge: does a lift, door or charger node on the graph keep the laws?"""

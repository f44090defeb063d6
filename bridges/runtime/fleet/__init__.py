"""A fleet in service: RMF's adapter on one side, the robots' buses on the other."""

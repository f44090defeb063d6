"""The service of a fleet: RMF's adapter, or its stand-in, on one side, and robots on the other."""

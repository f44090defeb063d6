"""The service of a fleet. The service connects robots with RMF's adapter, or with a stand-in for the
adapter."""

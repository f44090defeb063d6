"""A stand-in for RMF's fleets, as far as charging goes. The rules of its other nodes, which `judge`
plays too, are in `bridges/rmf_rules/`."""

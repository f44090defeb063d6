"""Commission a bridge: write a first YAML, examine the machine, and test each wire."""

"""Commission a bridge: write a first YAML, examine the machine, try each wire."""

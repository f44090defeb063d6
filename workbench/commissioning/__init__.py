"""Commission a bridge: draft the YAML, examine the machine, try each wire."""

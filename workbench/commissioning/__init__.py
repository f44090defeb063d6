"""Commission a bridge: draft its YAML, examine its machine, try each wire."""

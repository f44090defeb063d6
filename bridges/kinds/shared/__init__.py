"""What every decision core shares: decisions, debounce, kinds, and the fields of a device YAML."""

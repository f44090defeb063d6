"""Tools for people: observe, try and commission bridges. No daemon imports this package."""

"""The black box: what is kept, and how it is read."""

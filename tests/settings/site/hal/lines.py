"""A helper module beside the buses. It is no bus."""

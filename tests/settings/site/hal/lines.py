"""A helper module in the folder of the buses. It is not a bus."""

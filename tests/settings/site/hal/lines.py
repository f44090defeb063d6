"""A helper module of a bus's file, and no bus itself."""

"""The black box: its recordings, and the reading of recordings."""

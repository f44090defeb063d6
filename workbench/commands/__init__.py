"""Subcommands of `rmf-bridge` that run apart from a daemon. Each has a file here."""

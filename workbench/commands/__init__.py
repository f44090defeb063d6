"""Subcommands of `rmf-bridge` that run apart from a daemon. This folder has one file for each
subcommand."""

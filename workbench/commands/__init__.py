"""The subcommands of `rmf-bridge` that no daemon needs, a file each."""

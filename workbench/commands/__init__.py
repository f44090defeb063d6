"""The subcommands of `rmf-bridge` that no daemon needs, one file each."""

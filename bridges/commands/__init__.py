"""The subcommands of `rmf-bridge`, a file each: `add_arguments(parser)` and `run(args) -> int`."""

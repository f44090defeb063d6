"""The subcommands of `rmf-bridge`: each file has `add_arguments(parser)` and `run(args) -> int`."""

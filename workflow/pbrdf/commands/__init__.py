"""Subcommands of the command line, a file a topic."""

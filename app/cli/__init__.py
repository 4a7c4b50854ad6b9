"""The command line: a module a group of commands, options, and what a terminal shows."""

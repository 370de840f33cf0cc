"""The commands, one file each: `command` is what runs, and its docstring what `--help` says."""

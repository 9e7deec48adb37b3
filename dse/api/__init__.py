"""What the command line and Python callers do with problems: load, check, analyse, solve."""

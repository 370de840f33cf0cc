"""The page on a server of this machine alone."""

"""The command line and the reports: the only rooms that know all the others."""

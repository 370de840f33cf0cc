"""Finding the values that explain a scan: a Problem, a solver that is a value, and a Solution."""

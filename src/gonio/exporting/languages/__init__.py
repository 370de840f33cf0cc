"""Programming languages: each file declares one, and `Writer` prints any formula in it."""

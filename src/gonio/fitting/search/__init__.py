"""How the least error is found: solvers as values, and the searches that they are made of."""

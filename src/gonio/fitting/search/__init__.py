"""The search for the values of least E (guo2023, eq 11): solvers as values, and the searches that they are made of.

Solvers: `projection` (variable projection, the default) and `anneal` (the paper's simulated annealing). The first needs
`reduced` (a problem of the shape alone), `linear` (its exact weights), `starts` and `groups` (where searches begin) and
`descent` (the local search). `bulk` is for very many points, `cells` for very many values, `refit` for a minimum that
is near, `reweighting` for robust losses, and `strength` chooses how strongly parameters are held smooth.
"""

"""The search of problems of very many values, cell by cell (`objective.cells`).

`weights` are exact weights for one shape, `descent` is the local search of all values, and `search` puts both together.
"""

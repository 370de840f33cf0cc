"""How sure a fit is: covariance, bootstrap, profiles, bands, what the data determine, and what was left out.

`covariance` (`bulk` for very many points) is part of every fit. On demand come `bootstrap` and `profile`, intervals
that need no symmetry; `band`, the uncertainty of whatever follows from the values; `identifiability`, which values
trade off; `hold_out`, predictions of what a fit was not shown; `outliers`, points that do not belong, by the `noise` of
the scan. docs/intervals.md says how often their intervals hold the truth.
"""

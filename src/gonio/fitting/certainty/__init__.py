"""How sure a fit is: covariance, bootstrap, profiles, bands, what the data determine, and what was left out."""

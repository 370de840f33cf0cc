"""Is the set-up right? A mirror against Fresnel's equations, a diffuse standard against its certified curve (eq 9)."""

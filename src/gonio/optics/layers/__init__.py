"""Layers on a surface: thin films and clear coats as Fresnel factors of facets, and diffuse bodies below a boundary."""

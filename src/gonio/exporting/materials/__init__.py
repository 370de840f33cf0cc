"""Materials of picture programs as models: held to the formulas of their specifications, and fitted like any other.

They stand outside the catalogue, because no search for the model of a surface should try them: each is another surface
of GGX facets with Schlick's Fresnel factor, limited to what a renderer's sliders can say.
"""

"""Shading languages: GLSL, WGSL, OSL, and the files of Disney's BRDF Explorer."""

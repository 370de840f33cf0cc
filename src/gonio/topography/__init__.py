"""Height maps of surfaces: read, filtered, told by numbers, and made into the light that they scatter."""

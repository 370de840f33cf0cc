"""What a measurement says beyond its model: the residual of a fit, learned and carried to directions not measured."""

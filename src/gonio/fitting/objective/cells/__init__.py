"""The objective for very many values, most of which touch only the points of one wavelength, channel or scan.

`structure` finds the cells of a problem and the values that belong to one cell alone. `slopes` is the derivative of the
residual, one number for each point and parameter. `plane` is its tangent plane, eliminated cell by cell.
"""

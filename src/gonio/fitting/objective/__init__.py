"""What a fit minimises: a model and a scan as two functions of numbers, and what they are made of.

`problem` has these functions, and `options` what can be asked of them. `weighting`, `loss` and `smooth` define E;
`entries` names the values, `from_scan` reads options from the scan, `axes` scales the shape for a search.
`differences`, `slopes` and `tangent` are derivatives of the residual and what follows from them. `blocks`, with
`term_derivatives`, is the same objective for very many points, and `cells` for very many values. The minimum is found
in `gonio.fitting.search`.
"""

"""The kinds of covariance that a fit can be asked for, and how a value that is not determined is marked.

`certainty.covariance` computes them and gives the equations. The names have a file of their own because fits of one
scan, fits of many, the command line and the reader of solution files all need them.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]

COVARIANCES: Mapping[str, str] = {
    "robust": "from the residuals, however the noise depends on the signal (HC3)",
    "scaled": "from the residuals, with the same variance at every weighted point",
    "absolute": "from the standard uncertainty that the scan states",
}
DEFAULT, ABSOLUTE = "robust", "absolute"


def infinite(covariance: Values, unknown: npt.NDArray[np.bool_]) -> Values:
    """Mark the values that are not determined in a covariance (n, n), in place: infinite variance, no correlation.

    unknown (n,): which values these are.
    """
    covariance[unknown, :] = covariance[:, unknown] = 0.0
    covariance[unknown, unknown] = np.inf
    return covariance

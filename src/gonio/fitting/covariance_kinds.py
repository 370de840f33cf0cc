"""The kinds of covariance that a fit can be asked for, and how a value that is not determined is marked."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]

COVARIANCES: Mapping[str, str] = {
    "robust": "from the scatter about the fit, however it depends on the signal (HC3)",
    "scaled": "from the scatter about the fit, alike at every weighted point",
    "absolute": "from the uncertainty that the scan states, taken at its word",
}
DEFAULT, ABSOLUTE = "robust", "absolute"


def infinite(covariance: Values, unknown: npt.NDArray[np.bool_]) -> Values:
    """The covariance (n, n) with the values that are not determined marked: infinite variance, no correlation."""
    covariance[unknown, :] = covariance[:, unknown] = 0.0
    covariance[unknown, unknown] = np.inf
    return covariance

"""How far two reflectances are apart, how good a fit is, and which of several models is nearest to a scan."""

from gonio.comparison.assessment import Row, assess, validate
from gonio.comparison.metrics import METRICS, metrics
from gonio.comparison.ranking import compare

__all__ = ["METRICS", "Row", "assess", "compare", "metrics", "validate"]

"""How much two reflectances differ, how good a fit is, and which of several models fits a scan best."""

from gonio.comparison.assessment import Row, assess, validate
from gonio.comparison.metrics import METRICS, metrics
from gonio.comparison.ranking import compare

__all__ = ["METRICS", "Row", "assess", "compare", "metrics", "validate"]

"""Any table as a scan: text, workbooks, arrays and data frames, whose columns are named, sniffed or asked for."""

from gonio.tables.arrays import from_pandas, scan
from gonio.tables.read import read_table

__all__ = ["from_pandas", "read_table", "scan"]

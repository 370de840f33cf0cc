"""docs/where-to-measure.md is made of the record of `make designs`."""

import sys

from places import ROOT, loaded


def test_the_page_says_what_the_record_says(record):
    sys.path.insert(0, str(ROOT / "docs" / "pages"))
    try:
        made = loaded(ROOT / "docs" / "pages" / "where_to_measure.py")
    finally:
        sys.path.remove(str(ROOT / "docs" / "pages"))
    assert (ROOT / "docs" / "where-to-measure.md").read_text(encoding="utf-8") == made.page(record)

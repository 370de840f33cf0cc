"""How a search ended, in words that files hold."""

import pytest

from gonio.fitting.status import Status


def test_words_of_earlier_files_are_understood():
    before = "converged with a value at its bound: the data would have it beyond, or do not determine it"
    assert Status(before) is Status.AT_BOUND
    with pytest.raises(ValueError, match="is not a valid Status"):
        Status("converged with something else")

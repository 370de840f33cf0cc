"""Every door refuses damaged and hostile files in good order; `make fuzz` does the same for hours."""

import pytest

from fuzzing import quick, report
from gonio.formats import formats
from outcomes import EVERY_DOOR, HEIGHTS, TABLE
from workers import Process, Tally


@pytest.fixture(scope="session")
def worker():
    process = Process()
    yield process
    process.close()


@pytest.mark.parametrize("name", [*formats(), *EVERY_DOOR, TABLE, *HEIGHTS])
def test_damaged_and_hostile_files_are_read_or_refused_with_a_place(worker, name):
    total = Tally()
    for tally in worker.run(name, 0, 0, quick(name)):
        total.add(vars(tally))
    assert total.failures == [], report(name, 0, total.failures)
    assert total.inputs == quick(name)
    # A run in which hardly anything gets past the signature, or nothing survives, would test no reader.
    assert total.reached > 0.3 * total.inputs
    assert total.refused > 0.1 * total.inputs

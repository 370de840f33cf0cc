"""The fuzz harness itself: what it must call a failure, and that its inputs can be made again."""

import threading
import time

import numpy as np
import pytest

from gonio import formats as registry
from gonio.files import FormatError
from gonio.measured.coordinates import grid
from gonio.measured.dataset import make_scan
from outcomes import attempt, wrong_with_dataset, wrong_with_error
from seeds import damaged, seeds
from workers import Process, Tally


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, ""),
        ({"brdf": [1.0, np.inf]}, "infinite"),
        ({"brdf": [0.0, np.nan]}, "not zero"),
        ({"theta_i": [10, 95.0]}, "theta_i is not finite, or not within"),
        ({"theta_r": [10, np.nan]}, "theta_r is not finite"),
        ({"theta_r": [10, np.nan], "brdf": [1.0, np.nan]}, ""),
        ({"unit": "cd"}, "no unit"),
        ({"coordinates": {"wavelength": [500.0, -1.0]}}, "wavelength"),
    ],
)
def test_what_is_wrong_with_a_dataset(changes, said):
    scan = make_scan(**({"theta_i": [10, 20], "theta_r": [10, 20], "brdf": [1.0, 2.0], "phi": [0, 180]} | changes))
    found = wrong_with_dataset(scan)
    assert found == "" if not said else said in found


def test_a_grid_may_have_gaps_below_the_horizon_and_no_angle_twice():
    def scan(theta_i):
        axes = grid("specular", theta_i=theta_i, theta_s=[0.0, 60.0], phi_s=[0.0, 180.0])
        values = np.where(axes["theta_r"] > 90, np.nan, 1.0)
        return axes.assign(brdf=(axes["theta_r"].dims, values, {"units": "sr-1"}))

    assert wrong_with_dataset(scan([10.0, 50.0])) == ""
    assert "theta_i has gaps or repeats" in wrong_with_dataset(scan([50.0, 50.0]))
    filled = scan([10.0, 50.0])
    assert "theta_r" in wrong_with_dataset(filled.assign(brdf=filled["brdf"].fillna(1.0)))


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (FormatError("a.csv", "is odd", "line 1"), ""),
        (FormatError("a.csv", "is empty"), ""),
        (FormatError("a.csv", "is odd"), "names no place"),
        (FormatError("b.csv", "is odd", "line 1"), "does not name the file"),
        (FormatError("a.csv", "is\nodd", "line 1"), ""),  # escaped
        (FormatError("a.csv", "is odd", "line 1\nof 2"), "not one line"),
        (FormatError("a.csv", "is odd", "line \x1b[31m1"), "not one line"),
        (FormatError("a.csv", "x" * 2000, "line 1"), "characters long"),
    ],
)
def test_what_is_wrong_with_a_refusal(error, said):
    found = wrong_with_error(error, "a.csv")
    assert found == "" if not said else said in found


def test_an_exception_of_another_kind_is_a_failure(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("theta_i_deg,theta_r_deg,brdf_sr-1\n30,10,1\n")
    assert attempt(path, "tidy-csv") == ("read", "", True)

    def fails(path):
        raise IndexError("oops")

    monkeypatch.setattr(registry, "recognise", fails)
    outcome, why, _ = attempt(path, "tidy-csv")
    assert outcome == "failed"
    assert why.startswith("IndexError")


def test_inputs_follow_from_seed_and_number():
    made = [damaged("tidy-csv", 3, number) for number in range(40)]
    assert made == [damaged("tidy-csv", 3, number) for number in range(40)]
    assert made != [damaged("tidy-csv", 4, number) for number in range(40)]
    originals = {content for seed in seeds("tidy-csv") for content in seed.files.values()}
    assert sum(bytes(content) not in originals for seed, _ in made for content in seed.files.values()) > 30


def test_a_worker_that_dies_is_started_anew_and_the_input_is_a_failure():
    process, first, last = Process(), 100, 600

    def kill():
        while process._at_work() < first + 20:
            time.sleep(0.001)
        process.process.kill()

    try:
        killer = threading.Thread(target=kill, daemon=True)
        process.sign[:] = first.to_bytes(8, "little")
        killer.start()
        whole = Tally()
        for tally in process.run("tidy-csv", 0, first, last):
            whole.add(vars(tally))
        killer.join()
        assert whole.inputs == last - first
        (failure,) = whole.failures
        assert first + 20 <= failure["number"] < last
        assert failure["why"].startswith("the process ends with -9")
    finally:
        process.close()


def test_a_worker_that_cannot_begin_is_an_error_with_its_last_words():
    process = Process()
    try:
        with pytest.raises(RuntimeError, match="no worker for no-format: the process ends with 1: KeyError"):
            list(process.run("no-format", 0, 0, 10))
    finally:
        process.close()

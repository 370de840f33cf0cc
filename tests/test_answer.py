"""The answer where nothing is asked but a scan: the weighting, the model, the validation and the verdict."""

import json
import math

import numpy as np
import pytest
import xarray as xr

import gonio
from gonio.app.answering import watched
from gonio.comparison import answer as answering
from gonio.comparison.answer import answer
from gonio.comparison.assessment import assess
from gonio.comparison.consistency import contradictions
from gonio.comparison.race import sample_rows
from gonio.comparison.runs import Asked, Watch
from gonio.comparison.verdict import Verdict, as_part, scatter, verdict
from gonio.fitting.objective.automatic import RELATIVE_ERROR, chosen
from gonio.measured import dataset

THETA_I = (10.0, 30.0, 50.0)
THETA_R = np.arange(-80.0, 81.0, 10.0)
NARROW = {"rho_s": 0.5, "rho_d": 0.002, "width": 0.08, "index": 1.5, "extinction": 0.0}
FEW = [gonio.catalogue[name] for name in ("lambert", "ward", "ggx")]


def simulated(noise: float = 0.01, seed: int = 1, angles: tuple[float, ...] = THETA_I) -> xr.Dataset:
    return gonio.simulate(gonio.catalogue["ggx"], NARROW, angles, THETA_R, noise=noise, seed=seed)


def flat(values: list[float], uncertainty: list[float] | None = None, theta_r: list[float] | None = None) -> xr.Dataset:
    """A flat scan of these values at one incidence angle."""
    theta = np.linspace(-60.0, 60.0, len(values)) if theta_r is None else np.array(theta_r)
    columns = {} if uncertainty is None else {"uncertainty": np.array(uncertainty)}
    return dataset.make_scan(np.full(len(values), 20.0), theta, np.array(values), **columns)


class TestWeighting:
    """`weighting="auto"`: what the data ask for, and why."""

    def test_logarithms_of_positive_values_over_decades(self):
        choice = chosen(flat([1e-3, 1e-2, 1e-1, 1.0]))
        assert choice.weighting == "log"
        assert choice.reason == "all 4 values are positive and span 3.0 decades"

    def test_a_stated_uncertainty_within_two_decades(self):
        assert chosen(flat([0.1, 0.2, 1.0], uncertainty=[0.01, 0.02, 0.1])).weighting == "uncertainty"

    def test_logarithms_within_two_decades_where_no_uncertainty_is_stated_for_all(self):
        assert chosen(flat([0.1, 0.2, 1.0])).weighting == "log"
        assert chosen(flat([0.1, 0.2, 1.0], uncertainty=[0.01, 0.0, 0.1])).weighting == "log"

    def test_values_below_their_noise_have_no_logarithm_that_says_anything(self):
        noisy = chosen(flat([1e-4, 2e-4, 1e-3, 1.0], uncertainty=[1e-4, 1e-4, 1e-4, 1e-2]))
        assert noisy.weighting == "relative"
        assert noisy.noise_floor == pytest.approx(1e-4 / RELATIVE_ERROR)
        assert "less than 3 standard uncertainties" in noisy.reason

    def test_negative_values_show_the_noise(self):
        choice = chosen(flat([-0.001, 0.001, 0.003, 0.1, 5.0]))
        assert choice.weighting == "relative"
        assert choice.noise_floor == pytest.approx(0.001 / RELATIVE_ERROR)
        assert "1 of 5 values are not positive" in choice.reason
        assert "the 1 negative values" in choice.reason

    def test_repeats_show_the_noise_before_negative_values_do(self):
        choice = chosen(flat([-0.002, 0.002, 0.01, 0.02, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0], theta_r=[-50, -50, *range(8)]))
        assert choice.noise_floor == pytest.approx(math.sqrt(2) * 0.002 / RELATIVE_ERROR, rel=1e-2)
        assert "repeats" in choice.reason

    def test_zeros_leave_the_floor_among_the_positive_values(self):
        values = np.linspace(0.01, 1.0, 100)
        choice = chosen(flat([0.0, *values]))
        assert choice.weighting == "relative"
        assert choice.noise_floor == pytest.approx(np.quantile(values, 0.05), rel=1e-2)

    def test_a_few_wrong_values_do_not_count_for_more_than_all_others(self):
        """Negative ones of a millionth would have weights a million times those of the rest."""
        choice = chosen(flat([-1e-9, *np.linspace(0.01, 1.0, 100)]))
        assert choice.noise_floor == pytest.approx(0.0595, rel=1e-2)

    def test_a_floor_that_is_given_asks_for_relative_weighting(self):
        problem = gonio.Problem(FEW[0], flat([1e-3, 1.0]), weighting="auto", noise_floor=0.01)
        assert (problem.weighting, problem.noise_floor) == ("relative", 0.01)

    def test_the_choice_is_kept_with_the_fit(self, tmp_path):
        solution = gonio.fit(simulated(), "ward")
        solution.save(tmp_path / "s.nc")
        loaded = type(solution).load(tmp_path / "s.nc")
        assert loaded.dataset.attrs["weighting"] == "log"
        assert loaded.answer["weighting"]["reason"] == loaded.dataset.attrs["weighting_reason"] != ""
        assert loaded.answer == solution.answer


@pytest.fixture(scope="module")
def found():
    return answer(simulated(), FEW)


class TestAnswer:
    """Of several models the one that predicts best, with a verdict."""

    def test_the_model_that_made_the_scan_is_found(self, found):
        assert found.best.model.name == "ggx"
        assert found.verdict.grade == "good"
        assert found.left_out == "theta_i"

    def test_models_are_ranked_by_what_was_left_out_in_the_metric_of_the_weighting(self, found):
        errors = [row.validated["log10_rmse"] for row in found.rows]
        assert errors == sorted(errors)
        assert {row.metric for row in found.rows} == {"log10_rmse"}

    def test_every_model_is_told_of(self, found):
        assert {one["model"] for one in found.tried} == {"lambert", "ward", "ggx"}

    def test_the_record_is_plain_data_as_programs_rely_on(self, found):
        record = json.loads(json.dumps(found.record(), allow_nan=False))
        assert record["weighting"]["name"] == "log"
        assert record["validated"]["by"] == "theta_i"
        assert {"log10_rmse", "delta"} <= record["validated"].keys()
        assert {"grade", "typical_error", "left_out_error", "scatter"} <= record["verdict"].keys()
        assert record["tried"][0] == {"model": "ggx", "validated": found.best.validated["log10_rmse"]}

    def test_the_public_function_gives_the_same_fit(self, found):
        solution = gonio.fit(simulated(), ["lambert", "ward", "ggx"])
        assert solution.values == found.best.solution.values
        assert solution.answer["verdict"]["grade"] == "good"

    def test_results_do_not_depend_on_the_number_of_processes(self, found):
        parallel = answer(simulated(), FEW, Asked(workers=3))
        assert [row.solution.values for row in parallel.rows] == [row.solution.values for row in found.rows]

    def test_two_incidence_angles_are_left_out_in_parts(self):
        assert answer(simulated(angles=(10.0, 50.0)), FEW[:1]).left_out == answering.BLOCKS

    def test_a_weight_for_each_incidence_angle_is_judged_in_parts(self):
        scan = gonio.simulate(gonio.catalogue["lambert"], {"rho": 0.5}, THETA_I, THETA_R)
        found = answer(scan, FEW[:1], grouped={"rho": "theta_i"})
        assert found.left_out == answering.BLOCKS

    def test_a_scan_of_two_points_has_a_fit_and_no_validation(self):
        found = answer(flat([0.10, 0.11]), FEW)
        assert found.best.model.name == "lambert"
        assert not found.record()["validated"]
        assert found.record()["verdict"]["left_out_error"] is None

    def test_of_many_points_some_stand_for_all_while_models_are_compared(self, monkeypatch):
        monkeypatch.setattr(answering, "RACED", 30)
        found = answer(simulated(), FEW)
        assert found.raced <= 30
        assert found.best.model.name == "ggx"
        assert found.best.solution.dataset.attrs["points"] == len(THETA_I) * len(THETA_R)

    def test_of_many_wavelengths_some_stand_for_all(self, monkeypatch):
        """Each has weights of its own: a sample of every wavelength would determine none."""
        some = [
            simulated(seed=k).assign_coords(wavelength=("direction", np.full(51, 400.0 + 10 * k))) for k in range(8)
        ]
        scan = gonio.join({str(k): one for k, one in enumerate(some)}).drop_vars("scan")
        rows = sample_rows(dataset.points(scan), 240)
        assert len(np.unique(scan["wavelength"].values[rows])) == 1
        assert len(rows) == 51
        monkeypatch.setattr(answering, "RACED", 240)
        monkeypatch.setattr(answering, "VALIDATED", 300)
        found = answer(scan, FEW)
        assert (found.best.model.name, found.raced) == ("ggx", 51)
        assert found.best.validated["log10_rmse"] > 0
        assert len([name for name in found.best.solution.values if name.startswith("rho_s[")]) == 8

    def test_a_file_of_many_points_is_validated_only_if_asked(self, monkeypatch):
        monkeypatch.setattr(answering, "VALIDATED", 50)
        assert not answer(simulated(), FEW[:1]).best.validated
        assert answer(simulated(), FEW[:1], Asked(left_out="theta_i")).best.validated

    def test_progress_names_the_model_and_rows_come_as_they_are_there(self):
        told, rows = [], []
        answer(simulated(), FEW, None, Watch(lambda fraction, what: told.append((fraction, what)), rows.append))
        assert {what for _, what in told} == {"lambert", "ward", "ggx"}
        assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)
        assert {row.model.name for row in rows} == {"ward", "ggx"}  # lambert is hopeless after a look

    def test_a_problem_takes_no_second_model(self):
        with pytest.raises(ValueError, match="has its model and its options already"):
            gonio.fit(gonio.Problem(FEW[0], simulated()), "ggx")


def test_below_the_noise_floor_a_logarithm_says_nothing():
    """Measured values of a thousandth of the noise count as a tenth of the noise floor, and so do modelled ones."""
    scan = flat([-0.01, 1e-5, 0.5, 1.0, 2.0])
    problem = gonio.Problem(FEW[0], scan, weighting="relative", noise_floor=0.1)
    row = assess(problem, gonio.fit(problem))
    modelled = row.solution.brdf(problem.points)
    positive = np.log10(modelled[1:] / np.maximum(scan["brdf"].values[1:], 0.01))
    assert row.metrics["log10_rmse"] == pytest.approx(np.sqrt(np.mean(positive**2)))
    assert row.judged.floor == pytest.approx(0.01)


class TestVerdict:
    def test_errors_as_parts_of_the_value(self):
        assert as_part("log10_rmse", math.log10(1.12)) == pytest.approx(0.12)
        assert as_part("E", 0.04) == pytest.approx(0.2)

    @pytest.mark.parametrize(
        ("error", "own", "grade"),
        [(0.08, 0.01, "good"), (0.2, 0.15, "good"), (0.2, 0.01, "fair"), (0.8, 0.01, "poor"), (4.0, 0.01, "none")],
    )
    def test_grades(self, error, own, grade):
        from gonio.comparison.verdict import _grade

        assert _grade(error, own) == grade

    def test_what_was_not_validated_is_not_called_good(self):
        """Eight points are followed by a model of six values, which says nothing of others."""
        row = answer(flat([0.10, 0.11]), FEW[:1]).best
        found = verdict(row, flat([0.10, 0.11]))
        assert found.typical_error < 0.1
        assert found.grade == "fair"

    def test_words(self):
        fair = Verdict("gonio-best", "log10_rmse", "fair", 0.09, 0.14, 0.03)
        assert fair.words == (
            "gonio-best describes this scan: typical error 9 % (left out: 14 %), the scan's own scatter 3 %: fair"
        )
        none = Verdict("lambert", "log10_rmse", "none", 3.0, 4.0, math.nan)
        assert none.words == "no model here describes this scan: the best, lambert, is off by a factor of 5"
        values = Verdict("lambert", "E", "none", 1.0, 1.0, math.nan)
        assert values.words.endswith("the best, lambert, is off by 100 % of the weighted signal")

    def test_scatter_is_the_noise_of_a_smooth_curve(self):
        """Of 161 values with 2 % noise: the median absolute difference has a standard error of 8 %."""
        scan = gonio.simulate(
            gonio.catalogue["lambert"], {"rho": 0.5}, THETA_I, np.arange(-80.0, 81.0), noise=0.02, seed=3
        )
        assert scatter(dataset.points(scan)) == pytest.approx(0.02, rel=0.2)

    def test_a_scan_of_few_points_has_no_scatter(self):
        assert math.isnan(scatter(flat([0.1, 0.2, 0.3])))


class TestContradictions:
    ANGLES = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0)

    def scan(self, change=None) -> xr.Dataset:
        """A reciprocal scan of seven incidence angles with 1 % noise, and `change` of its values."""
        scan = gonio.simulate(
            gonio.catalogue["lambert"], {"rho": 0.5}, self.ANGLES, np.arange(-80.0, 81.0, 2.0), noise=0.01
        )
        points = dataset.points(scan)
        if change is not None:
            points["brdf"].values[:] = change(
                points["theta_i"].values, dataset.signed_theta_r(points), points["brdf"].values
            )
        return points

    def test_a_sound_scan_has_none(self):
        assert contradictions(self.scan()) == []

    def test_an_incidence_angle_that_the_others_contradict(self):
        found = contradictions(self.scan(lambda i, r, f: np.where(i == 70, 1.3 * f, f)))
        assert [(one.kind, one.theta_i, len(one.rows)) for one in found] == [("reciprocity", 70.0, 81)]
        assert "by a factor of 1.31, and they each other by 1.01" in found[0].words

    def test_of_two_camps_none_is_right(self):
        assert contradictions(self.scan(lambda i, r, f: np.where(i >= 50, 1.3 * f, f))) == []

    def test_a_shadow_at_the_end_of_a_curve(self):
        found = contradictions(self.scan(lambda i, r, f: np.where((i == 20) & (r > 75), f / 4, f)))
        assert [(one.kind, one.theta_i, len(one.rows)) for one in found] == [("edge", 20.0, 3)]
        assert "theta_i 20, theta_r 76 to 80 deg: the values fall by a factor of" in found[0].words

    def test_a_narrow_peak_near_the_end_is_no_edge(self):
        assert contradictions(self.scan(lambda i, r, f: np.where((i == 70) & (np.abs(r - 74) < 1), 50 * f, f))) == []

    def test_a_gap_is_no_edge(self):
        """Values on both sides of the blocked beam differ by more than one step."""
        points = self.scan(lambda i, r, f: np.where((i == 30) & (r < -60), f / 4, f))
        signed = dataset.signed_theta_r(points)
        there = (points["theta_i"].values != 30) | (signed < -70) | (signed > -50)
        assert contradictions(points.isel(direction=np.flatnonzero(there))) == []

    def test_transmission_and_turned_surfaces_are_not_judged(self):
        """Exchanged directions of transmission lie on the other side, and a turned surface has many curves."""
        points = self.scan(lambda i, r, f: np.where(i == 70, 1.3 * f, f))
        modes = np.full(points.sizes["direction"], "transmission")
        assert contradictions(points.assign_coords(mode=("direction", modes))) == []
        turned = np.arange(points.sizes["direction"]) % 2 * 90.0
        assert contradictions(points.assign_coords(phi_i=("direction", turned))) == []

    def test_what_is_contradicted_is_left_out_of_the_fit_and_told(self):
        scan = self.scan(lambda i, r, f: np.where(i == 70, 1.3 * f, f))
        found, everything = answer(scan, FEW[:1]), answer(scan, FEW[:1], Asked(keep_all=True))
        assert found.best.solution.dataset.attrs["points"] == 6 * 81
        assert everything.best.solution.dataset.attrs["points"] == 7 * 81
        assert [one["kind"] for one in found.record()["contradicted"]] == ["reciprocity"]
        assert found.best.solution.values["rho"] == pytest.approx(0.5, rel=1e-2)


class TestPresets:
    """`--dielectric` and `--metal`: what the surface is made of."""

    def test_a_dielectric_has_an_index_of_at_least_1_and_no_extinction(self):
        problem = gonio.Problem(gonio.catalogue["ggx"], simulated(), dielectric=True)
        by_name = {entry.name: entry for entry in problem.entries}
        assert by_name["index"].lower == 1
        assert by_name["extinction"].held == (0.0,)

    def test_a_metal_absorbs(self):
        problem = gonio.Problem(gonio.catalogue["ggx"], simulated(), metal=True)
        assert {e.name: e.lower for e in problem.entries}["extinction"] == 1

    def test_what_is_given_stays(self):
        problem = gonio.Problem(
            gonio.catalogue["ggx"], simulated(), dielectric=True, held={"extinction": 0.1}, bounds={"index": (1.3, 1.7)}
        )
        by_name = {entry.name: entry for entry in problem.entries}
        assert by_name["extinction"].held == (0.1,)
        assert by_name["index"].upper == 1.7

    def test_models_without_an_index_are_compared_all_the_same(self):
        rows = gonio.compare(simulated(), FEW, dielectric=True)
        assert {row.model.name for row in rows} == {"lambert", "ward", "ggx"}

    def test_a_model_without_an_index_alone_is_refused(self):
        with pytest.raises(ValueError, match="lambert has no parameter 'extinction'"):
            gonio.Problem(FEW[0], simulated(), dielectric=True)

    def test_both_are_refused(self):
        with pytest.raises(ValueError, match="exclude each other"):
            gonio.Problem(gonio.catalogue["ggx"], simulated(), dielectric=True, metal=True)


def test_ctrl_c_prints_the_models_that_are_fitted(capsys, found):
    """F11: what is done is not lost. The program ends by a signal with the same words (tests/test_ending.py)."""

    def interrupted():
        with watched("fitting") as watch:
            watch.fitted(found.rows[1])
            watch.fitted(found.rows[0])
            raise KeyboardInterrupt

    with pytest.raises(SystemExit) as ended:
        interrupted()
    assert ended.value.code == 130
    first, second, third = capsys.readouterr().err.splitlines()
    assert first == "stopped: 2 models were fitted in full, the best first"
    assert second.startswith(f"  {found.rows[0].model.name}: left-out lg RMSE ")
    assert third.startswith(f"  {found.rows[1].model.name}: left-out lg RMSE ")
    assert "width 0.08" in second

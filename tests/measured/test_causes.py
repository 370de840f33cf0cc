"""Systematic uncertainty by cause: through files, selections, joined scans, grids and corrections, without loss."""

import numpy as np
import pytest

from gonio import Problem, catalogue, check, convert, fit, join, read, write
from gonio.files import FormatError
from gonio.findings.corrections import divide
from gonio.fitting import Solution
from gonio.fitting.certainty.band import band
from gonio.formats import formats
from gonio.measured.causes import causes, total, with_causes
from gonio.measured.dataset import flatten, make_scan, points, select
from gonio.resampling.holdings import fitted_to

NAMES = ("standard", "dark[12]", "a cause, of ours", "=formula", "zéro")
THETA_I, THETA_R = np.repeat([10.0, 40.0], 9), np.tile(np.arange(-60, 61, 15.0), 2)
KEEPING = [f for f in formats().values() if f.write and "*" in f.holds.variables]
LOSING = [f for f in formats().values() if f.write and "*" not in f.holds.variables]


def scan(names=NAMES, seed=0, **more):
    rng = np.random.default_rng(seed)
    brdf = 0.2 + 0.1 * np.cos(np.radians(THETA_R))
    made = make_scan(THETA_I, THETA_R, brdf, uncertainty=0.01 * brdf, **more)
    return with_causes(made, {name: 0.01 * rng.standard_normal(len(brdf)) for name in names})


def same(one, other):
    assert list(causes(one)) == list(causes(other))
    for name, values in causes(one).items():
        assert values.tolist() == pytest.approx(causes(other)[name].tolist(), rel=1e-15), name
    assert one["uncertainty_systematic"].values == pytest.approx(total([*causes(one).values()]))


@pytest.mark.parametrize("kind", KEEPING, ids=lambda f: f.name)
def test_files_of_gonio_keep_every_cause_to_the_last_digit(tmp_path, kind):
    path = tmp_path / f"scan{kind.suffix}"
    write(scan(), path)
    again = read(path)
    same(again, scan())
    assert again["systematic"].attrs["units"] == "sr-1"
    second = tmp_path / f"again{kind.suffix}"
    done = convert(again, second)
    assert done.left_out == ()
    same(read(second), scan())


@pytest.mark.parametrize("kind", LOSING, ids=lambda f: f.name)
def test_other_formats_say_that_they_leave_the_causes_out(kind):
    data = scan().assign_attrs(quantity=kind.holds.quantity) if kind.holds.quantity else scan()
    if not kind.holds.reflection:
        data = data.assign_coords(mode=("direction", np.full(18, "transmission")))
    fitted, left_out = fitted_to(data, kind)
    assert {"systematic", "uncertainty_systematic"} <= set(left_out)
    assert not {"systematic", "cause"} & set(fitted.variables)


def test_columns_of_a_csv_that_do_not_fit_are_refused(tmp_path):
    path = tmp_path / "scan.csv"
    head = "theta_i_deg,theta_r_deg,brdf_sr-1,uncertainty_systematic_sr-1,systematic[zero]_sr-1"
    path.write_text(f"{head}\n10,0,0.3,0.004,-0.004\n10,20,0.3,0.004,0.004\n")
    assert causes(read(path)) == {"zero": pytest.approx([-0.004, 0.004])}
    for old, new, message in (
        ("0.3,0.004,-0.004", "0.3,0.004,-0.005", "does not add up to uncertainty_systematic"),
        ("systematic[zero]_sr-1", "systematic[zero]", "has no unit of a systematic uncertainty: write systematic"),
        ("systematic[zero]_sr-1", "systematic[zero]_a.u.", "one unit for both"),
        ("0.004,-0.004", "0.004,x", "line 2"),
    ):
        path.write_text(f"{head}\n10,0,0.3,0.004,-0.004\n10,20,0.3,0.004,0.004\n".replace(old, new))
        with pytest.raises(FormatError) as caught:
            read(path)
        assert message in str(caught.value)


def test_the_total_alone_is_one_cause():
    alone = make_scan([10.0], [0.0], [0.3], variables={"uncertainty_systematic": ([0.01], "sr-1")})
    assert causes(alone) == {"systematic": pytest.approx([0.01])}
    assert causes(make_scan([10.0], [0.0], [0.3])) == {}


def test_masks_selections_and_grids_keep_them():
    masked = scan().assign(mask=("direction", (np.arange(18) == 3).astype(np.int8)))
    used = points(masked)
    assert causes(used)["standard"].tolist() == np.delete(causes(scan())["standard"], 3).tolist()
    part = select(scan(coordinates={"channel": np.repeat(["a", "b"], 9)}), {"channel": "b"})
    assert causes(part)["dark[12]"].tolist() == causes(scan())["dark[12]"][9:].tolist()
    grid = scan().assign_coords(place=("direction", np.arange(18)))
    dense = (
        grid.drop_vars("place")
        .rename(direction="node")
        .reset_coords(drop=False)
        .set_coords(["theta_i", "theta_r", "phi"])
    )
    same(flatten(dense), scan())


def test_a_factor_scales_them():
    halved = divide(scan(), 2.0)
    assert causes(halved)["standard"] == pytest.approx(causes(scan())["standard"] / 2)
    assert halved["uncertainty_systematic"].values == pytest.approx(scan()["uncertainty_systematic"].values / 2)


def test_joined_scans_share_what_is_common_and_keep_apart_what_is_not():
    one, two = scan(("standard", "dark[1]")), scan(("standard", "dark[1]", "zero"), seed=1)
    joined = join({"a": one, "b": two})
    found = causes(joined)
    assert list(found) == ["standard", "dark[1] of a", "dark[1] of b", "zero"]
    assert found["standard"].tolist() == [*causes(one)["standard"], *causes(two)["standard"]]
    assert found["dark[1] of a"].tolist() == [*causes(one)["dark[1]"], *[0.0] * 18]
    assert joined["uncertainty_systematic"].values == pytest.approx(
        np.append(one["uncertainty_systematic"], two["uncertainty_systematic"])
    )


def test_a_joined_scan_without_causes_is_told_and_the_others_count():
    plain = make_scan(THETA_I, THETA_R, np.full(18, 0.2), uncertainty=np.full(18, 0.002))
    unnamed = plain.assign(uncertainty_systematic=plain["brdf"] * 0.01)
    for other, names in ((scan(("standard",)), ["standard"]), (unnamed, ["systematic"])):
        joined = join({"a": other, "b": plain})
        assert list(causes(joined)) == names
        assert "took no systematic uncertainty for b, which states none" in joined.attrs["history"]
        assert fit(Problem(catalogue["lambert"], joined)).has_systematic
    assert "took no" not in join({"a": plain, "b": plain}).attrs["history"]
    named = join({"a": unnamed, "b": scan(("standard",))})
    assert list(causes(named)) == ["systematic", "standard"]


def test_a_fit_is_moved_by_each_cause_and_saved_with_all(tmp_path):
    brdf = 0.3 + 0.0 * THETA_R
    data = with_causes(
        make_scan(THETA_I, THETA_R, brdf, uncertainty=0.01 * brdf),
        {"scale": 0.02 * brdf, "odd": 0.05 * brdf * np.sign(THETA_R), "offset": np.full(18, 0.003)},
    )
    solution = fit(Problem(catalogue["lambert"], data), covariance="absolute")
    rho = solution.values["rho"]
    record = solution.parameters()["rho"]
    # what is odd about the normal cancels in a value that is the mean of both sides
    assert record["systematic"] == pytest.approx({"scale": 0.02 * rho, "odd": 0.0, "offset": 0.01 * rho}, abs=1e-12)
    assert record["uncertainty_systematic"] == pytest.approx(rho * np.hypot(0.02, 0.01))
    low, high = solution.intervals(0.95)["rho"]
    half = 1.959964 * np.hypot(record["uncertainty"], record["uncertainty_systematic"])
    assert (high - low) / 2 == pytest.approx(half, rel=1e-6)
    assert np.isnan(solution.dataset["systematic_shift"]).all()  # no one signed vector stands for several causes
    at = band(solution, points(data))
    assert at["uncertainty_systematic"].values == pytest.approx(at["brdf"].values * np.hypot(0.02, 0.01))
    solution.save(tmp_path / "solution.nc")
    again = Solution.load(tmp_path / "solution.nc")
    assert again.causes == ("scale", "odd", "offset")
    assert again.parameters() == solution.parameters()


def test_a_total_that_was_changed_alone_is_found():
    stale = scan().assign(uncertainty_systematic=scan()["uncertainty_systematic"] * 2)
    (finding,) = [f for f in check(stale) if f.name == "causes"]
    assert "does not add up to uncertainty_systematic" in finding.what

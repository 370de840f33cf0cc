"""Plans: order, blocked angles, duration, the file and its hash, and what is no plan."""

import tomllib
from dataclasses import replace

import pytest

from gonio.acquisition import Conditions, Layout, Plan, Step, grid, planned, read_plan
from gonio.acquisition.layout import angles
from gonio.files import FormatError


def kinds(plan):
    return [step.kind for step in plan.steps]


def sweep(plan, theta_i):
    return [step.theta_r for step in plan.steps if step.kind == "sample" and step.theta_i == theta_i]


def test_incidence_is_outermost_and_the_arm_goes_to_and_fro():
    plan = grid([20, 30, 40], range(-60, 61, 20), layout=Layout(dark_every=0))
    assert [s.theta_i for s in plan.steps if s.kind == "sample"] == [20] * 7 + [30] * 7 + [40] * 7
    assert sweep(plan, 20) == sweep(plan, 40) == sorted(sweep(plan, 20))
    assert sweep(plan, 30) == sorted(sweep(plan, 20), reverse=True)


def test_repeats_are_sweeps_back():
    plan = grid([20], [0, 10, 20], layout=Layout(repeats=2, dark_every=0))
    assert sweep(plan, 20) == [0, 10, 20, 20, 10, 0]


def test_the_arm_hides_what_its_width_gives():
    """20 mm and a beam of 1.5 mm at 500 mm hide asin(0.043) = 2.464478 deg; more may be asked for, less is refused."""
    layout = Layout(arm_half_width=20, beam_radius=1.5, distance=500)
    assert layout.hidden == pytest.approx(2.464478, abs=5e-7)
    plan = grid([30], [-33, -32, -28, -27], layout=layout)
    assert sweep(plan, 30) == [-33, -27]
    assert [(s.theta_i, s.theta_r) for s in plan.skipped] == [(30, -32), (30, -28)]
    assert "within 2.464 deg of the source" in plan.skipped[0].reason
    assert len(grid([30], [-33, -27, 0], layout=replace(layout, blocked=5)).skipped) == 2
    with pytest.raises(ValueError, match=r"blocked is 1 deg, and the arm hides 2\.464 deg"):
        replace(layout, blocked=1)


def test_out_of_plane_the_angle_to_the_source_counts():
    plan = grid([30], [30], [0, 10, 90, 180], layout=Layout(blocked=8))
    assert [s.phi for s in plan.skipped] == [0, 10] or [s.phi for s in plan.skipped] == [0]
    near = planned([(30, 30, 16)], Layout(blocked=7.9))  # 2 asin(sin 30 sin 8) = 7.98 deg
    assert not near.skipped


def test_darks_checks_and_references_are_at_both_ends():
    layout = Layout(dark_every=3, check=(0, 45), check_every=4, incident=True, standard=(0, 45))
    plan = grid([20], range(0, 80, 10), layout=layout)
    assert kinds(plan)[:4] == ["dark", "incident", "standard", "check"]
    assert kinds(plan)[-4:] == ["check", "standard", "incident", "dark"]
    middle = kinds(plan)[4:-4]
    assert middle == [*["sample"] * 3, "dark", "sample", "check", "sample", "sample", "dark", "sample", "sample"]


def test_a_background_is_measured_at_every_direction():
    plan = grid([20], [0, 10], layout=Layout(background=True))
    assert [(s.theta_i, s.theta_r) for s in plan.steps if s.kind == "background"] == [(20, 0), (20, 10)]


def test_the_duration_is_travel_settling_and_reading():
    conditions = Conditions(dwell=2, settle=0.5, table_speed=5, arm_speed=20)
    plan = Plan(conditions, (Step("dark"), Step("sample", 30, -20), Step("sample", 30, 0), Step("incident")))
    # the arm goes from 180 to 10, to 30, to 180 deg at 20 deg/s, the table from 0 to 30 at 5 deg/s
    assert plan.duration == pytest.approx(4 * 2 + 3 * 0.5 + 170 / 20 + 30 / 5 + 20 / 20 + 150 / 20)


def test_the_file_says_what_the_plan_says(tmp_path):
    """Written, read, edited without another meaning: one hash."""
    layout = Layout(check=(0, 45), blocked=5)
    plan = grid(
        [20, 30], [-25, 0, 25.5], layout=layout, conditions=Conditions(wavelength=632.8, filter='nd "2" µ\x7f\\')
    )
    plan.write(tmp_path / "plan.toml")
    assert read_plan(tmp_path / "plan.toml") == plan
    text = (tmp_path / "plan.toml").read_text(encoding="utf-8")
    (tmp_path / "edited.toml").write_text("# a remark\n" + text.replace("dwell = 1.0", "dwell = 1"), encoding="utf-8")
    assert read_plan(tmp_path / "edited.toml").sha256 == plan.sha256
    (tmp_path / "other.toml").write_text(text.replace("dwell = 1.0", "dwell = 2"), encoding="utf-8")
    other = read_plan(tmp_path / "other.toml")
    assert other.sha256 != plan.sha256
    assert plan.difference(other) == "dwell is 1.0 here and 2.0 there"
    with pytest.raises(FileExistsError):
        plan.write(tmp_path / "plan.toml")


def test_out_of_plane_steps_keep_their_azimuth(tmp_path):
    plan = grid([30], [10, 20], [90, 135])
    plan.write(tmp_path / "plan.toml")
    assert read_plan(tmp_path / "plan.toml") == plan
    assert Step("sample", 30, 20, 90).direction == (30, 20, 90)
    assert Step("sample", 30, -20).direction == (30, 20, 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("steps = [", "is no TOML"),
        ('format = "gonio plan 2"', "its format is 'gonio plan 2'"),
        ('steps = [["dark"]]', "its format is 'not stated'"),
        ('format = "gonio plan 1"\nsteps = []', "without steps"),
        ('format = "gonio plan 1"\nsteps = 3', "steps is no array"),
        ('format = "gonio plan 1"\nspeed = 3\nsteps = [["dark"]]', "speed, which no plan has"),
        ('format = "gonio plan 1"\ndwell = "x"\nsteps = [["dark"]]', "dwell is 'x'"),
        ('format = "gonio plan 1"\ndwell = -1\nsteps = [["dark"]]', "dwell is -1"),
        ('format = "gonio plan 1"\ndwell = nan\nsteps = [["dark"]]', "dwell is nan"),
        ('format = "gonio plan 1"\npolarisation = "x"\nsteps = [["dark"]]', "the polarisation is 'x'"),
        ('format = "gonio plan 1"\nsteps = [["dark"], ["sample", 30]]', "step 2: a step is sample without angles"),
        ('format = "gonio plan 1"\nsteps = [["sample", 30, 90]]', "step 1: the step sample 30 90 is outside"),
        ('format = "gonio plan 1"\nsteps = [["sample", nan, 0]]', "step 1: the step sample nan 0 is outside"),
        ('format = "gonio plan 1"\nsteps = [["sample", 30, -20, 90]]', "step 1: the step sample 30 -20 90 is outside"),
        ('format = "gonio plan 1"\nsteps = [["sample", 30, true]]', "step 1 is ['sample', 30, True]"),
        ('format = "gonio plan 1"\nsteps = [["dusk"]]', "a step is 'dusk'"),
        ('format = "gonio plan 1"\nsteps = [["dark", 1, 2]]', "a step is dark with angles"),
        ('format = "gonio plan 1"\nsteps = [["dark"]]\nskipped = [[1, 2]]', "skipped direction 1"),
    ],
)
def test_what_is_no_plan_is_refused_with_its_place(tmp_path, text, said):
    (tmp_path / "plan.toml").write_text(text)
    with pytest.raises(FormatError, match=r"plan\.toml") as caught:
        read_plan(tmp_path / "plan.toml")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_toml_is_written_as_it_is_read():
    plan = grid([30], [0], conditions=Conditions(filter="a\nb\tc"))
    assert tomllib.loads(plan.text)["filter"] == "a\nb\tc"


@pytest.mark.parametrize(
    ("text", "expected"),
    [("20:70:10", [20, 30, 40, 50, 60, 70]), ("-1:1:0.4", [-1, -0.6, -0.2, 0.2, 0.6, 1.0]), ("3,1:2:1", [3, 1, 2])],
)
def test_ranges_of_angles(text, expected):
    assert angles(text, "--theta-i") == expected


@pytest.mark.parametrize("text", ["", "1:2", "1:2:0", "2:1:1", "a", "1:2:3:4", "nan", "0:1:1e-9"])
def test_what_is_no_range_is_refused(text):
    with pytest.raises(ValueError, match="--theta-i is"):
        angles(text, "--theta-i")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: grid([30], [-30]), None),
        (
            lambda: grid([30], [-30], layout=Layout(blocked=5)),
            "no direction can be measured: within 5 deg of the source",
        ),
        (lambda: grid([], [0]), "none is given"),
        (lambda: grid([30], [95]), "outside"),
        (lambda: grid([30], [0], layout=Layout(blocked=5, check=(30, -30))), "the direction of check"),
        (lambda: grid([30], [0], layout=Layout(check_every=3)), "check_every needs a direction"),
        (lambda: Layout(arm_half_width=600), None),
        (lambda: grid([30], [0], layout=Layout(arm_half_width=600)), "the arm is 600 mm wide"),
    ],
)
def test_plans_that_cannot_be(make, said):
    if said is None:
        make()
        return
    with pytest.raises(ValueError, match=said):
        make()


def test_the_first_difference_is_named():
    one, two = grid([30], [0, 10]), grid([30], [0, 20])
    assert one.difference(two) == "step 3 is sample 30 10 here and sample 30 20 there"
    assert one.difference(grid([30], [0])) != ""
    assert one.difference(one) == ""

"""Every format's sample through every command that takes a scan: no refusal but one that names the physics.

In the way of a user: what the file holds, what is wrong with it, a fit, a ranking, a figure, a table, and back again.
"""

import re

import pytest

from gonio.formats import formats

HUGE = {"merl", "pbsdf", "utia"}  # millions of values: as a table of text they are hundreds of megabytes
LARGEST = 100_000  # bytes of a sample that is tried
# What a sample may be refused for: what its numbers are, never in which file or on which grid they lie.
PHYSICS = (
    r"models describe reflection, but the scan (is of transmission alone|has transmission)",
    r"no in-plane curve to draw",
    r"specular (reflectance|transmittance)",  # the weight of a Dirac lobe
    r"is of light that went through",
    r"values lie outside the data|has no value there",  # a full grid from a few directions
    r"scatter [\d.e+]+ % of the light",  # an invented sample that would shine
    r"relative \(a\.u\.\), and .* cannot say so",
    r"turned to \d+ azimuths, and .* holds an isotropic one",
    r"holds one \w+ and the data have \d+",  # several sets in a file of one
    r"holds? the channels",
    r"(reflection|transmission) alone",
)


def of_every_format():
    return [pytest.param(name, id=name) for name in sorted(set(formats()) - HUGE)]


def chosen(paths):
    """The largest sample below LARGEST bytes, else the smallest; the size of a folder is that of its files."""

    def size(path):
        return sum(p.stat().st_size for p in path.rglob("*")) if path.is_dir() else path.stat().st_size

    return max(paths, key=lambda path: (size(path) < LARGEST, size(path) if size(path) < LARGEST else -size(path)))


@pytest.mark.no_cover  # counting the lines of so many commands takes half as long as they do
@pytest.mark.parametrize("name", of_every_format())
def test_a_sample_goes_through_every_command(name, run, sample_files, tmp_path, coarse_tables, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kind, sample = formats()[name], chosen(sample_files[name])
    steps = [
        ("info", sample),
        ("check", sample),
        ("fit", sample, "--model", "lambert"),
        ("compare", sample, "--models", "lambert"),
        ("plot", sample, "--models", "lambert", "--out", "figure.png"),
        ("convert", sample, "table.csv"),
        ("info", "table.csv"),
        ("fit", "table.csv", "--model", "lambert"),
    ]
    if kind.write is not None:
        steps.append(("convert", "table.csv", f"back{kind.suffix}", "--to", name, "--fill", "symmetry,lambert"))
    refused = {}
    for step in steps:
        code, _, err = run(*step)
        assert "mistake in gonio" not in err, (step, err)
        if code:
            *warnings, refusal = err.strip().splitlines()
            assert all(": warning: " in line for line in warnings), (step, err)
            assert any(re.search(why, refusal) for why in PHYSICS), (step, err)
            refused[step[0]] = refusal
    assert {"info", "check"}.isdisjoint(refused)
    assert (tmp_path / "table.csv").exists()

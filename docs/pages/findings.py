"""Writes docs/findings.md from benchmarks/planted.json and from the thresholds in the code."""

from typing import Any

from _pages import BENCHMARKS, DOCS, table, write

from gonio.findings import angles, clipped, cosine, magnitude, turned
from planted import PLANTS

RECORD, PAGE = BENCHMARKS / "planted.json", DOCS / "findings.md"

HEAD = """# Mistakes that a scan shows

`make pages` writes this page; do not edit it.

`gonio info FILE` and `gonio check FILE` look for the mistakes below before anything is fitted; `gonio fit`, `compare` and `plot` print
the warnings among them on standard error. With `--json -` both give them under `findings`, each with `name`, `severity`, `evidence` and
`remedy`. In Python: `gonio.check(scan)`. All are warnings or notes: a scan may be right all the same. A retroreflector looks like a reversed sign.
Not a mistake, but noted too: `grain`, where values change as a surface is turned ([what to fit](howto/grain.md), a retroreflector as well).

A remedy is a flag of every command that reads a scan. The mended scan says what was done in its history, and uncertainties change with
the values. `gonio convert FILE OUT --flip` writes it. In Python each flag is a function of `gonio.findings.corrections`. Flags act in
this order: `--select`, `--radians`, `--flip`, `--mirror-azimuth`, `--shift-theta-r`, `--divide-cosine`, `--divide`, `--saturation`,
`--blocked`, `--floor`.

"""
LATER = """
## Why these thresholds

{reasons}

## What cannot be seen

{unseen}

## How often they are found

Each mistake was planted in four measured scans, at two strengths each, and in all {scans} scans of the collection at the first strength
(tables out of plane for the azimuth). *Shown by* says what a scan must hold. The last column names the scans in which the plant was not
found: there nothing shows it. On the {scans} scans and the four tables as they are, {alarms}.

{results}

Measured by `make planted` on {date}.
"""
# name: evidence, remedy
MISTAKES = {
    "sign-reversed": (
        f"in plane, the side of the light: at the largest incidence angle the largest value near and beyond the backscatter direction is over "
        f"{turned.TWICE:g} times that near and beyond the mirror direction, and at no angle from {turned.STEEP:g}° on it is the other way round. "
        f"Where one side alone was measured: a peak within {turned.NEAR:g}° of −theta_i, or values that grow {turned.LIMB:g} times towards the horizon",
        "`--flip`",
    ),
    "azimuth-mirrored": (
        f"the same out of plane, within {turned.SECTOR:g}° of azimuth about the plane of incidence",
        "`--mirror-azimuth` (180° − phi), or `--flip` (phi + 180°); on an isotropic surface both are one",
    ),
    "cosine-left-in": (
        f"dividing by cos theta_r makes reciprocity {cosine.BETTER:g} times better ({cosine.BETTER_OF_FEW:g} times for fewer than {cosine.FEW} pairs of "
        f"directions), by the median of abs ln f(i, r)/f(r, i), and by {cosine.SIGMAS:g} standard uncertainties. A note for relative data, which may be "
        "signals",
        "`--divide-cosine`",
    ),
    "radians": (
        f"no polar angle is above π/2 and they are no multiples of {angles.ROUND:g}; or the values of one column are multiples of "
        f"{angles.ROUND_IN_DEGREES:g}° once taken for radians, and are not as they stand",
        "`--radians`",
    ),
    "reflectance-above-one": (
        f"the directional-hemispherical reflectance R of a table is above 1; in plane, R of an isotropic surface with these values is above "
        f"{magnitude.ESTIMATE:g}, or above {magnitude.BRUSHED:g} where one side of the normal was measured and the surface has a lobe. In plane and up to {magnitude.BRUSHED:g} it is a note",
        "`--divide VALUE`",
    ),
    "percent": ("that, and R/100 is not", "`--divide 100`"),
    "factor-pi": ("that, and R/π is not, where both sides were measured or the surface is matt", "`--divide pi`"),
    "angle-zero-shifted": (
        f"the peak lies off the mirror direction by the same angle, over {angles.LEAST_SHIFT:g}° and half a step, at {100 * angles.MOSTLY:.0f} % of the "
        f"incidence angles whose lobe has a half width up to {angles.NARROW:g}°",
        "`--shift-theta-r DEG`",
    ),
    "saturated": (
        f"{clipped.RUN} neighbours at the top of a peak are exactly one number, in f or in f cos theta_r; or two whose own neighbours differ",
        "`--saturation VALUE` masks values from there on",
    ),
    "floor": (
        f"{100 * clipped.SHARE:.0f} % of the values within {clipped.USUAL:g}°, {clipped.LEAST} at least, are exactly the least value, in f or in f cos "
        f"theta_r. A note where it is more than {100 * clipped.HALF:.0f} %: that may be a computed constant",
        "`--floor VALUE` masks values below",
    ),
}
REASONS = {
    "sign-reversed": "A matt surface that favours the back (Oren and Nayar) does so by less than 2, and Fresnel's reflectance sends flat light forward "
    "from every surface without retroreflecting structure. Behind the normal values grow towards the horizon by less than 3 (Lommel and Seeliger, "
    "70°). So the largest incidence angle decides, and one angle that shows the right side clears the scan.",
    "cosine-left-in": "Multiplied by cos theta_r, ln f(i, r)/f(r, i) is ln(cos theta_r/cos theta_i) and no longer 0: the two hypotheses are compared. Values "
    "between measured angles are interpolated in ln f. Measured scans are reciprocal to 1 to 22 % in the median, which a cosine exceeds.",
    "reflectance": "In plane the lobe is taken to keep its shape in direction cosines (Harvey and Shack), the lower of both sides counts, and what was not "
    "measured counts as 0. 1.25 allows 10 % for calibration and 15 % for a peak that is two samples wide. A brushed surface fans its light "
    "out in the plane that is scanned: measured steel comes to 8.7, so 20 is asked where the backscatter side, which would show the fan, is absent.",
    "angle-zero-shifted": "A slope of ln f moves the peak of a lobe of half width h by h²/(2 ln 2) tan theta π/180, 0.3° for 5° at 45°; off-specular peaks of rough "
    "surfaces grow with tan theta_i and are not constant. Good goniometers are aligned to 0.3°. A peak narrower than the steps may lie half a "
    "step off.",
    "saturated": "Measured neighbours differ in their last digits. A round top that was rounded falls by one such digit beside its plateau, a peak that was "
    "cut by many; a computed lobe between two angles has equal neighbours on both sides.",
    "floor": "Beyond 80° instruments and formats write fillers for what was not measured. Rounding ties other values as well, a floor the least one alone. "
    "A computed lobe on a constant comes to it by degrees.",
}
UNSEEN = [
    "**A factor pi on a dark surface**: a reflectance of 0.1 becomes 0.3, which is possible. So is percent below a reflectance of about 1/80, and both where only "
    "the forward side was measured and R is small. For R between 1.25 and 3.9 pi and percent are both possible, and both are named.",
    "**A shifted angle on a rough surface**: no narrow lobe tells the zero. A tilted sample cannot be told from a shifted arm.",
    "**A cosine at one incidence angle**, in a table that is reciprocal by its format (MERL), and cos theta_i cos theta_r, which is reciprocal.",
    "**A reversed sign or azimuth** below incidence of 15°, and phi counted in the other sense, which an isotropic surface does not show.",
    "**One saturated value a peak**, and a floor with noise on it or a constant that was added: a matt part looks the same.",
    "**Mistakes of stacks** of many scans, which are fitted without being looked through.",
]


def page(record: dict[str, Any]) -> str:
    """The page of a record of planted mistakes."""
    rows = []
    for name, row in record["planted"].items():
        missed = ", ".join(row["missed"]) or "–"
        scans = ", ".join(PLANTS[name].scans)
        found = f"{row['scans'] - len(row['missed'])} of {row['scans']}"
        rows.append(
            [
                f"`{name}`",
                PLANTS[name].what,
                scans,
                PLANTS[name].visible,
                f"**{row['found']} of {row['of']}**",
                found,
                missed,
            ]
        )
    heads = ["mistake", "planted as", "in", "shown by", "found", "in all scans", "not found in"]
    alarms = record["alarms"]
    return (
        HEAD
        + table(["mistake", "evidence", "remedy"], [[f"`{n}`", *cells] for n, cells in MISTAKES.items()], 3)
        + "\n"
        + LATER.format(
            reasons="\n".join(f"- `{name}`: {text}" for name, text in REASONS.items()),
            unseen="\n".join(f"- {text}" for text in UNSEEN),
            scans=record["scans"],
            alarms="no alarm was raised" if not alarms else f"false alarms were raised on {', '.join(alarms)}",
            results=table(heads, rows, 7),
            date=record["date"],
        )
    )


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make planted")

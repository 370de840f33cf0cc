"""The first part of docs/real-surfaces.md: what every model predicts, from benchmarks/validated.json."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from gonio.plotting.style import COLOURS, house_style, new_figure

RESULTS = Path(__file__).resolve().parents[2] / "benchmarks" / "validated.json"
OURS = "gonio-best"
T_S, T_C = ("torrance-sparrow",), ("wang-2016", "liu-2016")
PAPER = {"T-S": 57.16, "T-C": 30.61}  # guo2023, averages of Tables 2 and 3 [%], of its own metric and in sample
PEERS = {"AnoBlackEC1onAlum": 0.0445, "merl_aluminium_slice": 0.0733}  # lg RMSE of a 13-value binomial, in sample
LISTED = 12
BARE, OVER, COATED, FREED = "student-t", "student-t-coated", "coated-body", "coated-body, its index free"
FREE = "a diffuse lobe of free width"
HALFWAY = 1.5  # between the exponents of the two tails
CLEAR = 0.05  # of an error: a difference that is told
MARKERS = ("s", "D", "^", "o")

Models = dict[str, dict[str, Any]]


def results() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(RESULTS.read_text(encoding="utf-8"))
    return loaded


def scans(found: dict[str, Any]) -> dict[str, Models]:
    """The measured scans, without the two full sets that peers fitted."""
    return {name: scan["models"] for name, scan in found["scans"].items() if name not in PEERS}


def least(models: Models, names: tuple[str, ...] = ()) -> str:
    """Of some models or of all, the one that predicts best."""
    return min(names or models, key=lambda name: error(models[name]))


def error(row: dict[str, Any], which: str = "left_out") -> float:
    """Left-out lg RMSE, or the fitted one; infinite where a model has none."""
    return np.inf if row[which] is None else float(row[which])


def drops(some: dict[str, Models], of: str, reference: tuple[str, ...], which: str = "left_out") -> list[float]:
    """Drop of the error of a model, or of the best one for `of` empty, against the better of the references [%]."""
    out = []
    for models in some.values():
        new = error(models[of or least(models)], which)
        old = min(error(models[name], which) for name in reference)
        out.append(100 * (1 - new / old))
    return out


def pooled(some: dict[str, Models], of: str, reference: tuple[str, ...]) -> float:
    """Drop of the mean error over the scans [%]."""
    new = np.mean([error(models[of or least(models)]) for models in some.values()])
    old = np.mean([min(error(models[name]) for name in reference) for models in some.values()])
    return float(100 * (1 - new / old))


FLOORED = "2026-11-30"  # when lg RMSE got its floor (docs/conventions.md)
OLD_METRIC = [
    "These values were made before lg RMSE had its floor (`docs/conventions.md`): points at which a model is zero or below are",
    "left out of that model's.",
]


def lines(found: dict[str, Any]) -> list[str]:
    some = scans(found)
    return [
        "## Which model predicts best",
        "",
        f"Made by `make validated` on {found['date']} ({found['machine']}). Each of the {len(next(iter(some.values())))} models",
        "that a search tries is fitted in logarithms, so that every decade counts alike, with nothing free by incidence angle, and judged by lg",
        "RMSE, the rms error of the decimal logarithm, at each incidence angle in turn that its fit was not shown.",
        *OLD_METRIC * (found["date"] < FLOORED),
        *(
            f"Of {' and '.join(f'`{one}`' for one in names)} they were made on {when}."
            for when, names in found.get("added", {}).items()
        ),
        "",
        *conclusions(some),
        papers_metric(found),
        "",
        "![Left-out error of every scan](images/real-surfaces-validated.png)",
        "",
        *table(some),
        "",
        "### What a user gets",
        "",
        *nested(found),
        "",
        "### How much of the error is the data's own",
        "",
        *of_the_data(found),
        "",
        "### The models by their mean over the scans",
        "",
        *ranking(some),
        "",
        "### Against the best fits of peers",
        "",
        *peers(found),
        "",
        f"### What each part of `{OURS}` is worth",
        "",
        *parts(found),
        "",
        "### A coated diffuse body",
        "",
        *coated(found),
        "",
    ]


def conclusions(some: dict[str, Models]) -> list[str]:
    winners = [least(models) for models in some.values()]
    ours = winners.count(OURS)
    others = sorted({w for w in winners if w != OURS}, key=lambda w: (-winners.count(w), w))
    text = [
        f"- **{OURS}** predicts best on {ours} of {len(some)} scans; the others go to "
        + ", ".join(f"{name} ({winners.count(name)})" for name in others)
        + ".",
    ]
    for which, name in ((f"`{OURS}`", OURS), ("the best model of each scan", "")):
        means = {short: np.mean(drops(some, name, reference)) for short, reference in (("T-S", T_S), ("T-C", T_C))}
        whole = {short: pooled(some, name, reference) for short, reference in (("T-S", T_S), ("T-C", T_C))}
        text.append(
            f"- **Left-out error of {which}:** lower by {means['T-S']:.1f} % than that of T-S and by {means['T-C']:.1f} % than that of the "
            f"better T-C model, means of the scans' percentages; the mean error itself is lower by {whole['T-S']:.1f} and {whole['T-C']:.1f} %."
        )
    easiest = min(some, key=lambda name: error(some[name][T_S[0]]))
    text.append(
        f"- Where T-S is near already there is little to win: on {easiest} it errs by "
        f"{100 * (10 ** error(some[easiest][T_S[0]]) - 1):.0f} %."
    )
    return text


def nested(found: dict[str, Any]) -> list[str]:
    """The error of a model that is chosen without the angle that judges it, beside those of one for all and in hindsight."""
    columns: dict[str, list[float]] = {"chosen": [], OURS: [], "hindsight": []}
    rows = []
    for name, models in scans(found).items():
        counts = found["scans"][name]["folds"]
        chosen = []
        for fold in counts:
            others = [other for other in counts if other != fold]
            best = min(models, key=lambda model: over(models[model], counts, others))
            chosen.append((counts[fold], models[best]["by_fold"][fold], best))
        own = float(np.sqrt(sum(n * e**2 for n, e, _ in chosen) / sum(n for n, _, _ in chosen)))
        hindsight = error(models[least(models)])
        for column, value in zip(columns.values(), (own, error(models[OURS]), hindsight), strict=True):
            column.append(value)
        named = Counter(model for _, _, model in chosen)
        rows.append([name, *(f"{v:.4f}" for v in (own, error(models[OURS]), hindsight)),
                     ", ".join(f"{model} ({count})" for model, count in named.most_common())])  # fmt: skip
    means = {head: float(np.mean(values)) for head, values in columns.items()}
    gain = np.log(np.array(columns["chosen"]) / columns[OURS])
    change, uncertainty = 100 * np.expm1(gain.mean()), 100 * gain.std(ddof=1) / np.sqrt(len(gain))
    verdict = (
        "a difference"
        if abs(change) > 2 * uncertainty
        else "less than two standard errors, so no difference that means anything"
    )
    return [
        "Above, *best model* is chosen by the angles that judge it, which nobody can do beforehand. Here it is chosen for each angle by the left-out errors",
        "at all other angles, and judged by that angle. The fits that are compared at the other angles saw it. In brackets is for how many angles a model was chosen.",
        "",
        f"| scan | chosen without the angle | `{OURS}` everywhere | best in hindsight | chosen |",
        "|---|---:|---:|---:|---|",
        *("| " + " | ".join(row) + " |" for row in rows),
        f"| **mean of {len(rows)}** | " + " | ".join(f"**{mean:.4f}**" for mean in means.values()) + " | |",
        "",
        f"Choosing a model for each scan changes the geometric mean of the error by {change:+.1f} % against `{OURS}` everywhere (standard error "
        f"{uncertainty:.1f} %): {verdict}.",
    ]


def over(model: dict[str, Any], counts: dict[str, int], some: list[str]) -> float:
    """The left-out error of a model over some of the angles; infinite where it has none at one of them."""
    errors = [np.inf if model["by_fold"].get(fold) is None else model["by_fold"][fold] for fold in some]
    return float(sum(counts[fold] * e**2 for fold, e in zip(some, errors, strict=True)))


def of_the_data(found: dict[str, Any]) -> list[str]:
    """Left-out error between the angles and at the steepest, beside what reciprocity and repeats leave to no model."""
    rows = []
    for name, models in scans(found).items():
        scan, ours = found["scans"][name], models[OURS]
        counts = scan["folds"]
        steepest = max(counts, key=lambda fold: float(fold.split()[-1]))
        inner = [fold for fold in counts if fold != steepest]
        between = np.sqrt(over(ours, counts, inner) / sum(counts[fold] for fold in inner))
        asymmetry, repeats = scan["reciprocity"], scan.get("repeats")
        floor = np.hypot(asymmetry["least"] or 0.0, repeats or 0.0)
        share = f"{100 * min(1.0, (floor / error(ours)) ** 2):.0f}" if floor else "–"
        rows.append([name, f"{between:.4f}", f"{ours['by_fold'][steepest]:.4f}",
                     "–" if asymmetry["least"] is None else f"{asymmetry['least']:.4f}", str(asymmetry["pairs"]),
                     "–" if repeats is None else f"{repeats:.4f}", share])  # fmt: skip
    return [
        f"Left-out lg RMSE of `{OURS}`, apart for the steepest incidence angle, which is extrapolated. Beside it stands what no reciprocal model can",
        "take. *Reciprocity*: half the rms difference of lg of directions that were measured both ways, the least rms error there of any reciprocal model. *Repeats*: the rms",
        "standard deviation of lg over repeated readings, where the scan states it. *Share*: the squares of both over that of the error.",
        "",
        "| scan | between the angles | at the steepest | reciprocity | pairs | repeats | share [%] |",
        "|---|---:|---:|---:|---:|---:|---:|",
        *("| " + " | ".join(row) + " |" for row in rows),
    ]


def papers_metric(found: dict[str, Any]) -> str:
    """Drops of left-out nRMSE, the paper's metric, beside the paper's own."""
    some = [scan["nrmse"] for name, scan in found["scans"].items() if name not in PEERS]
    parts = []
    for weighting in some[0]:
        means = {
            short: np.mean([100 * (1 - one[weighting][OURS] / min(one[weighting][n] for n in names)) for one in some])
            for short, names in (("T-S", T_S), ("T-C", T_C))
        }
        parts.append(f"by {means['T-S']:.1f} % against T-S and by {means['T-C']:.1f} % against T-C in {weighting} fits")
    return (
        f"- **In the paper's own metric**, nRMSE, whose mean drops there are {PAPER['T-S']} % against T-S and {PAPER['T-C']} % against T-C "
        f"(four samples, in sample): the left-out nRMSE of `{OURS}` is lower {', and '.join(parts)}."
    )


def table(some: dict[str, Models]) -> list[str]:
    out = [
        f"| scan | best model | free | left out | fitted | {OURS} | T-S | T-C | cauchy-lorentz | its reciprocal form | vs T-S % | vs T-C % |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    against = [drops(some, "", reference) for reference in (T_S, T_C)]
    for (name, models), *drop in zip(some.items(), *against, strict=True):
        best = least(models)
        errors = [models[m] for m in (OURS, *T_S, least(models, T_C), "cauchy-lorentz", "cauchy-lorentz-reciprocal")]
        out.append(
            f"| {name} | {best} | {models[best]['free']} | **{error(models[best]):.4f}** | {error(models[best], 'fitted'):.4f} | "
            + " | ".join(f"{error(row):.4f}" for row in errors)
            + " | "
            + " | ".join(f"{value:+.0f}" for value in drop)
            + " |"
        )
    cells = " | ".join(f"**{np.mean(values):+.1f}**" for values in against)
    mean = [
        np.mean([error(models[least(models)], which) for models in some.values()]) for which in ("left_out", "fitted")
    ]
    rest = [
        np.mean([error(models[least(models, names)]) for models in some.values()])
        for names in ((OURS,), T_S, T_C, ("cauchy-lorentz",), ("cauchy-lorentz-reciprocal",))
    ]
    out.append(
        f"| **mean of {len(some)}** | | | **{mean[0]:.4f}** | {mean[1]:.4f} | "
        + " | ".join(f"{value:.4f}" for value in rest)
        + f" | {cells} |"
    )
    return out


def ranking(some: dict[str, Models]) -> list[str]:
    names = list(next(iter(some.values())))
    mean = {name: np.mean([error(models[name]) for models in some.values()]) for name in names}
    out = ["| model | values | left out, mean | fitted, mean | best on |", "|---|---:|---:|---:|---:|"]
    winners = [least(models) for models in some.values()]
    for name in sorted(names, key=lambda n: mean[n])[:LISTED]:
        fitted = np.mean([error(models[name], "fitted") for models in some.values()])
        free = min(models[name]["free"] for models in some.values())
        out.append(f"| {name} | {free} | {mean[name]:.4f} | {fitted:.4f} | {winners.count(name)} |")
    return out


def peers(found: dict[str, Any]) -> list[str]:
    out = [
        "The best fit that peers make of these two sets is a 13-value binomial, in sample, over values above 1e-9 and cos θᵣ above 1e-3.",
        "",
        f"| set | points | peers, fitted | {OURS}, fitted | its values | left out | binomial here, fitted | left out |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for name, bar in PEERS.items():
        models = found["scans"][name]["models"]
        ours, theirs = models[OURS], models["binomial"]
        out.append(
            f"| {name} | {found['scans'][name]['points']} | {bar:.4f} | **{error(ours, 'fitted'):.4f}** | {ours['free']} | "
            f"{error(ours):.4f} | {error(theirs, 'fitted'):.4f} | {error(theirs):.4f} |"
        )
    return out


def parts(found: dict[str, Any]) -> list[str]:
    """Left-out error without each part over that with it, by scan and on average."""
    names = list(next(iter(found["scans"].values()))["without"])
    out = [
        f"Left-out lg RMSE of `{OURS}` with one part changed, over that of the model as it is: above 1 the change predicts worse. Its diffuse lobe is a",
        "Lambertian unless its width is freed; the other two parts are held at nothing.",
        "",
        "| scan | whole | " + " | ".join(names) + " |",
        "|---|---:|" + "---:|" * len(names),
    ]
    ratios = []
    for name, scan in found["scans"].items():
        whole = error(scan["models"][OURS])
        ratios.append([error(scan["without"][part]) / whole for part in names])
        out.append(f"| {name} | {whole:.4f} | " + " | ".join(f"{ratio:.2f}" for ratio in ratios[-1]) + " |")
    middle = np.exp(np.mean(np.log(ratios), axis=0))
    out.append("| **geometric mean** | | " + " | ".join(f"**{ratio:.2f}**" for ratio in middle) + " |")
    return [*out, "", *lobe(found)]


def coated(found: dict[str, Any]) -> list[str]:
    """Left-out errors of coated bodies beside those of a Lambertian under the same facets, and where each wins."""
    some = {name: scan for name, scan in found["scans"].items() if name not in PEERS}
    columns = {
        name: {model: error(scan["models"][model]) for model in (BARE, OVER, COATED, OURS)}
        for name, scan in some.items()
    }
    for name, scan in some.items():
        columns[name][FREED] = error(scan["freed"])
    heads = (BARE, OVER, COATED, FREED, OURS)
    out = [
        f"Left-out lg RMSE. `{OVER}` is `{BARE}` with a [coated body](models/{OVER}.md) of index 1.5 in the place of its Lambertian, as many",
        f"values. `{COATED}` has one index for the facets and the body, held at 1.5: two values fewer. In the last column but one it is free.",
        "",
        "| scan | " + " | ".join(heads) + " |",
        "|---|" + "---:|" * len(heads),
    ]
    for name, row in columns.items():
        cells = [
            f"**{row[h]:.4f}**" if h != OURS and row[h] == min(row[x] for x in heads[:-1]) else f"{row[h]:.4f}"
            for h in heads
        ]
        out.append(f"| {name} | " + " | ".join(cells) + " |")
    means = [np.mean([row[h] for row in columns.values()]) for h in heads]
    out.append(f"| **mean of {len(columns)}** | " + " | ".join(f"{mean:.4f}" for mean in means) + " |")
    return [
        *out,
        "",
        *(told(columns, which, values) for which, values in ((OVER, "as many values"), (COATED, "two values fewer"))),
    ]


def told(columns: dict[str, dict[str, float]], which: str, values: str) -> str:
    """Where a coated body predicts clearly better than a Lambertian does, and where worse."""
    ratio = {name: row[which] / row[BARE] for name, row in columns.items()}
    wins = [
        f"{name} ({100 * (1 - r):.0f} %)"
        for name, r in sorted(ratio.items(), key=lambda item: item[1])
        if r < 1 - CLEAR
    ]
    loses = [
        f"{name} ({100 * (r - 1):.0f} %)"
        for name, r in sorted(ratio.items(), key=lambda item: -item[1])
        if r > 1 + CLEAR
    ]
    beats = [name for name, row in columns.items() if row[which] < row[OURS]]
    return (
        f"- **`{which}`** ({values}) predicts more than {100 * CLEAR:.0f} % better than `{BARE}` on {', '.join(wins) or 'no scan'}, and more than "
        f"{100 * CLEAR:.0f} % worse on {', '.join(loses) or 'no scan'}. It is ahead of `{OURS}` on {', '.join(beats) or 'no scan'}."
    )


def lobe(found: dict[str, Any]) -> list[str]:
    """Where the paper's Cauchy-Lorentz lobe about the normal earns its place, in words."""
    ratio = {n: error(scan["without"][FREE]) / error(scan["models"][OURS]) for n, scan in found["scans"].items()}
    tails = {name: scan["tail"] for name, scan in found["scans"].items()}
    near = [f"{name} ({c:.2f})" for name, c in tails.items() if c < HALFWAY]
    helps = [f"{name} ({100 * (1 - r):.0f} %)" for name, r in ratio.items() if r < 1 - CLEAR]
    hurts = [f"{name} ({100 * (r - 1):.0f} %)" for name, r in ratio.items() if r > 1 + CLEAR]
    return [
        f"The paper's Cauchy-Lorentz lobe, as a diffuse part of free width, predicts more than {100 * CLEAR:.0f} % better than a Lambertian on "
        f"{', '.join(helps) or 'no scan'}, and more than {100 * CLEAR:.0f} % worse on {', '.join(hurts) or 'no scan'}.",
        f"Its form serves better about the mirror direction: the tail of the unscattered lobe, whose exponent is 1 for Cauchy-Lorentz and 2 "
        f"for GGX, lies nearer to Cauchy-Lorentz on {len(near)} of {len(tails)} sets: {', '.join(near)}.",
    ]


def figure(found: dict[str, Any]) -> Any:
    """Left-out error of every scan: the paper's models, T-S, T-C and the best."""
    some = scans(found)
    shown = {
        "torrance-sparrow (T-S)": T_S,
        "better of wang-2016 and liu-2016 (T-C)": T_C,
        "cauchy-lorentz": ("cauchy-lorentz",),
        OURS: (OURS,),
    }
    with house_style():
        drawn = new_figure(8.6, 5.6)
        ax = drawn.subplots()
        places = np.arange(len(some))
        for k, (label, names) in enumerate(shown.items()):
            values = [min(error(models[n]) for n in names) for models in some.values()]
            style = {"color": COLOURS[k], "marker": MARKERS[k], "linestyle": "none", "markersize": 6}
            ax.plot(values, places, label=label, **style)
        ax.set_yticks(places, list(some))
        ax.invert_yaxis()
        ax.set_xscale("log")
        ax.set_xticks([0.02, 0.05, 0.1, 0.2, 0.5], ["0.02", "0.05", "0.1", "0.2", "0.5"])
        ax.minorticks_off()
        ax.set_xlabel("rms error of lg BRDF at incidence angles left out of the fit [1]")
        ax.grid(axis="y", visible=True, alpha=0.4)
        drawn.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return drawn

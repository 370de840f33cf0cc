"""Writes docs/performance.md from benchmarks/results.json; part of `make bench` and `make bench-quick`."""

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
RECORD, GROWTH, CRASH = (ROOT / "benchmarks" / f"{n}.json" for n in ("results", "growth", "crash"))
MEANING = {
    "evaluation_over_mitsuba": (
        "1e7 pairs of unit vectors in single precision: GGX with Fresnel or Cauchy-Lorentz, whichever gains less, as fast"
        " as Mitsuba 3's rough conductor (llvm_ad_rgb) this many times",
        "1",
    ),
    "evaluation_over_copy": ("the same, as part of the speed at which as many bytes are copied on all cores", "0.5"),
    "fits_over_scipy": ("a stack of fits as fast as SciPy least_squares over all parameters this many times", "25"),
    "long_scan_seconds": ("one scan of 1e5 samples, GGX with Fresnel, fitted once it is compiled [s]", "at most 0.25"),
    "anneal_one_over_many": ("annealing of Appendix A, a scan among 128 as fast as alone this many times", ""),
    "anneal_over_exact": ("annealing of Appendix A takes this many times as long as exact weights, for no lower E", ""),
    "dual_annealing_over_exact": ("SciPy dual_annealing takes this many times as long, for no lower E", ""),
    "dask_two_over_one": ("fit-stack with two workers as fast as with one this many times", "1.7"),
    "lmfit_over_fit": ("lmfit, from one start, takes this many times as long as a fit from many with covariance", ""),
    "lumos_over_evaluation": ("1e6 pairs of ABg in double precision as fast as Lumos-Sat this many times", ""),
    "anneal_over_exact_all_scans": ("annealing over exact weights, median of all scans and models", ""),
    "anneal_over_exact_least": ("the least of these", ""),
    "anneal_over_exact_free_shape": ("the same with free shape, median", ""),
    "help_seconds": ("`gonio --help` [s]", "at most 0.5"),
    "import_seconds": ("`import gonio` [s]", "at most 0.3"),
    "fit_copper_seconds": ("`gonio fit` of the copper scan, ks by incidence [s]", "at most 3"),
}
GPU = (
    ("1e6 fits of a stack in under 1 s", "fits"),
    ("evaluation at half of the memory bandwidth", "evaluation"),
)
HEAD = """# Performance

Made by `make bench-quick` and `make bench` from [results.json](../benchmarks/results.json); do not edit. A figure is a
ratio of two things that ran in turn in one process, the median of at least five rounds, on the machine and day beside it
with its load (processes that wanted to run; a machine alone has less than one). Ratios of processor time, which other
users of a machine change less, stand in parentheses. Those of evaluation are of JAX arrays. Two workers against one are
the median of five pairs (`python benchmarks/cluster_speed.py`; `make bench-quick` has time for two), which are in
results.json.
"""


def number(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def row(name: str, results: dict[str, Any]) -> str:
    meaning, target = MEANING.get(name, (name, ""))
    value = results["figures"].get(name)
    if value is None:
        return f"| {meaning} | {results['reasons'].get(name, 'not measured')} | {target} | | |"
    details = results["details"].get(name, {})
    measured = details.get("measured", {})
    found = [
        one for key, one in {"": details, **details}.items() if isinstance(one, dict) and "numpy" not in key.lower()
    ]
    processor = [one["ratio_of_processor_time"] for one in found if "ratio_of_processor_time" in one]
    least = f" ({number(min(processor))})" if processor else ""
    return (
        f"| {meaning} | {number(value)}{least} | {target} | {measured.get('date', '')} | {measured.get('load', '')} |"
    )


def models(results: dict[str, Any]) -> list[str]:
    """Each model and kind of array of the two figures of evaluation."""
    lines = []
    for name in ("evaluation_over_mitsuba", "evaluation_over_copy"):
        for key, found in results["details"].get(name, {}).items():
            if isinstance(found, dict) and "pairs_per_second" in found:
                peer = name.removeprefix("evaluation_over_")
                ratios = f"{found['ratio']:.2f} | {found['ratio_of_processor_time']:.2f}"
                lines.append(f"| {key} | {peer} | {found['pairs_per_second']:.2e} | {ratios} |")
    return lines


def growth() -> str:
    """The cost of a fit from 1e3 to 1e6 scans, where it was measured."""
    if not GROWTH.exists():
        return "Not measured yet: `python benchmarks/fits_speed.py --growth`.\n"
    found = json.loads(GROWTH.read_text(encoding="utf-8"))
    head = f"`python benchmarks/fits_speed.py --growth` on {found['machine']}, {found['date']}:\n\n"
    head += "| scans | microseconds a fit | stack [MB] | solution [MB] | growth of peak memory beyond making the stack [MB] |\n"
    rows = [
        f"| {r['scans']:,} | {r['microseconds_a_fit']:.0f} | {r['stack_MB']:.0f} | {r['solution_MB']:.0f} "
        f"| {r['peak_growth_MB']:.0f} |"
        for r in found["rows"]
    ]
    t = found["thoroughness"]
    tail = (
        f"\n\nOf {t['scans']:,} such scans {t['ended_higher']} ended more than 1e-6 of E above the best of a longer search "
        f"(by {t['highest_excess_of_E']:.1g} at most). In single precision E differs from that best by "
        f"{t['single_precision_excess_of_E_median']:.1g} in the median and by less than "
        f"{t['single_precision_excess_of_E_99th_percentile']:.1g} in 99 of 100.\n"
    )
    return head + "|---:|---:|---:|---:|---:|\n" + "\n".join(rows) + tail


def crashes() -> str:
    """What became of a run that was killed, where that was tried."""
    if not CRASH.exists():
        return ""
    found = json.loads(CRASH.read_text(encoding="utf-8"))
    same = "the same to the last bit as" if found["bitwise_equal"] else "NOT the same as"
    return (
        f"`make bench-crash` ({found['date']}): {found['scans']:,} scans in {found['blocks']} blocks, with "
        f"{len(found['kills'])} kills (SIGKILL) of a worker or of the whole run at random moments: {same} an undisturbed "
        f"run. Blocks were begun {found['computations']} times, "
        f"{len(found['blocks_computed_after_they_were_written'])} times after they were written.\n"
    )


def page(results: dict[str, Any]) -> str:
    names = [name for name in MEANING if name in results["figures"]]
    rows = [row(name, results) for name in (*names, *(n for n in results["figures"] if n not in MEANING))]
    parts = [
        HEAD,
        f"Last on {results['machine']}, {results['date']}.\n",
        "| figure | value | to reach | day | load |\n|---|---:|---|---|---:|\n" + "\n".join(rows) + "\n",
        "## Evaluation\n",
        "NumPy arrays in and out, and JAX arrays whose memory is used again, as Mitsuba does with its own.\n",
        "| model, arrays | against | pairs a second | ratio of time | of processor time |\n|---|---|---:|---:|---:|\n"
        + "\n".join(models(results))
        + "\n",
        "## Many fits\n",
        growth(),
        crashes(),
        "## On a GPU\n",
        'The same code runs there: `evaluate(.., device="gpu")` or JAX arrays that lie on it.\n',
        "| figure | value |\n|---|---|\n"
        + "\n".join(f"| {what} | not measured: no GPU was at hand |" for what, _ in GPU),
    ]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    (ROOT / "docs" / "performance.md").write_text(
        page(json.loads(RECORD.read_text(encoding="utf-8"))), encoding="utf-8"
    )

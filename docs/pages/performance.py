"""Writes docs/performance.md from the records of benchmarks/."""

import json
from typing import Any

from _pages import BENCHMARKS, DOCS, write

NAMES = ("results", "growth", "crash", "interrupts", "gpu", "hyperspectral")
RECORD, GROWTH, CRASH, INTERRUPTS, GPU, SPECTRA = (BENCHMARKS / f"{name}.json" for name in NAMES)
PAGE = DOCS / "performance.md"
MEANING = {
    "evaluation_over_mitsuba": (
        "Evaluation of 1e7 direction pairs in single precision: time of Mitsuba 3's rough conductor (llvm_ad_rgb) divided"
        " by gonio's, for GGX with Fresnel or Cauchy-Lorentz, whichever is slower",
        "1",
    ),
    "evaluation_over_copy": (
        "The same evaluation: time to copy as many bytes on all cores divided by gonio's time",
        "0.5",
    ),
    "fits_over_scipy": ("Fits: time per scan of SciPy least_squares divided by time per scan in a stack", "25"),
    "long_scan_seconds": ("One scan of 1e5 samples, GGX with Fresnel, after compilation [s]", "at most 0.25"),
    "anneal_one_over_many": ("Annealing: time per scan fitted alone divided by time per scan in a stack of 128", ""),
    "anneal_over_exact": (
        "Time of annealing (Appendix A) divided by that of exact weights, which reach as low an E",
        "",
    ),
    "dual_annealing_over_exact": ("Time of SciPy dual_annealing divided by that of exact weights", ""),
    "dask_two_over_one": ("`gonio fit-stack`: time with one worker divided by time with two", "1.7"),
    "lmfit_over_fit": ("Time of lmfit from one start divided by that of a fit from many, with covariance", ""),
    "lumos_over_evaluation": (
        "Evaluation of 1e6 pairs of ABg in double precision: time of Lumos-Sat divided by gonio's",
        "",
    ),
    "anneal_over_exact_all_scans": (
        "Time of annealing divided by that of exact weights: median of all scans and models",
        "",
    ),
    "anneal_over_exact_least": ("The smallest of these ratios", ""),
    "anneal_over_exact_free_shape": ("The median where the shape is free too", ""),
    "help_seconds": ("`gonio --help` [s]", "at most 0.5"),
    "import_seconds": ("`import gonio` [s]", "at most 0.3"),
    "fit_copper_seconds": ("`gonio fit` of the copper scan, ks by incidence angle [s]", "at most 3"),
}
HEAD = """# Performance

`make pages` writes this page from [results.json](../benchmarks/results.json), which `make bench-quick` and `make bench`
measure; do not edit it. A ratio compares two programs that ran in turn in one process; it is the median of at least five
rounds. Beside it stand the day and the load: the number of processes that wanted to run, below one on an idle machine.
Ratios of processor time stand in parentheses; other users of a machine change them less. Ratios of evaluation are of JAX
arrays. The ratio of two workers is the median of five pairs (`python benchmarks/cluster_speed.py`).
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


def interrupts() -> str:
    """What became of commands that a signal asked to end, where that was tried."""
    if not INTERRUPTS.exists():
        return ""
    found = json.loads(INTERRUPTS.read_text(encoding="utf-8"))
    rows = found["commands"]
    trials, failures = (sum(row[name] for row in rows.values()) for name in ("trials", "failures"))
    slowest = max(row["slowest_end_s"] for row in rows.values())
    names = ", ".join(f"`{name}`" for name in rows)
    return (
        f"`make interrupt` ({found['date']}): {trials:,} signals at random moments of {names}, SIGINT as Ctrl-C sends it and "
        f"SIGTERM, to all processes of the command and to its main process alone. {failures} left a traceback, a second line, "
        f"a process or a file that is not whole, or another exit code than 130 or 143; all was gone within {slowest:.1f} s at "
        f"most ({found['limit_s']:g} s are allowed).\n"
    )


def gpu() -> str:
    """What `make bench-gpu` measured on a GPU, where one was at hand."""
    if not GPU.exists():
        return "Not measured yet: `make bench-gpu` needs an NVIDIA GPU.\n"
    record = json.loads(GPU.read_text(encoding="utf-8"))
    evaluation, fits = record["evaluation"], record["fits"]
    head = (
        f"`make bench-gpu` on one {record['device']}, {record['machine']}, {record['date']}. Evaluation is of "
        f"{evaluation['pairs']:.0e} pairs in single precision in the memory of the GPU; a copy there moves "
        f"{evaluation['copy_bytes_a_second'] / 1e12:.2f} TB/s. Fits are those of {fits['scans']:,} scans of "
        f"{fits['points']} points that begin and end in the memory of the host.\n\n"
    )
    rows = [
        f"| Evaluation, {name}: time of a copy of as many bytes divided by gonio's "
        f"| {evaluation[name]['part_of_a_copy']:.2f} | 0.5 |"
        for name in evaluation
        if isinstance(evaluation[name], dict)
    ]
    rows += [
        f"| {fits['scans']:,} fits, {name} [s] | {number(fits[name]['seconds'])} | {'at most 1' * ('alone' in name)} |"
        for name in fits
        if isinstance(fits[name], dict)
    ]
    return (
        head + "| figure | value | to reach |\n|---|---:|---|\n" + "\n".join(rows) + f"\n\n{record.get('remark', '')}\n"
    )


def spectra() -> str:
    """What whole commands take on scans of many wavelengths, where that was measured."""
    if not SPECTRA.exists():
        return "Not measured yet: `make bench-hyperspectral`.\n"
    found = json.loads(SPECTRA.read_text(encoding="utf-8"))
    head = (
        f"`make bench-hyperspectral` on {found['machine']}, {found['date']}, load {found['load']}. Whole commands, from "
        "reading the file to the last line of the report; scans have 34 directions for each wavelength. Wall time is that "
        "of this load; processor time is what an idle core takes.\n\n"
        "| wavelengths | command | wall time [s] | processor time [s] | peak memory [MB] | to reach |\n"
        "|---:|---|---:|---:|---:|---|\n"
    )
    rows = [
        f"| {r['wavelengths']:,} | `gonio {r['command']}` | {r['seconds']:.1f} | {r['processor_seconds']:.1f} "
        f"| {r['peak_MB']} | {'60 s, 2000 MB' * r['bound']} |"
        for r in found["rows"]
    ]
    tail = (
        "\n\nMost values of such a fit touch the points of one wavelength alone. From 64 values and 2^19 points times "
        "values on, the derivative is held in a block for each wavelength, and what all wavelengths share is eliminated: "
        "time and memory grow with the number of wavelengths. Only the covariance is a matrix of all pairs of values: "
        "8 bytes times the square of their number. A shape that all wavelengths share is searched on some of them, and "
        "its minimum on all; where nothing is shared, each wavelength is a search of its own. Annealing keeps one matrix "
        "of all points and weights for each chain. A fit that would need more memory than there is says so before it "
        "begins.\n"
    )
    return head + "\n".join(rows) + tail


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
        interrupts(),
        "## Many wavelengths\n",
        spectra(),
        "## On a GPU\n",
        gpu(),
    ]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make bench-quick")

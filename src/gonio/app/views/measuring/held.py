"""What files of raw readings hold: the journal of a measurement, or a table; and the command that comes next."""

import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.acquisition.journal import Content, read_journal
from gonio.app.output import faint, strong, table
from gonio.app.views.file import LONGEST, MOST_LINES, listed
from gonio.app.views.measuring import measured
from gonio.files import FormatError
from gonio.outside import printable
from gonio.raw import Reader, journal, reader_of_raw
from gonio.reduction.readings import NET, checked

JOURNAL, READINGS = "journal", "readings"  # values of `kind` in the record
STANDARD = "VALUE+-U:factor@THETA_I,THETA_R"
INCIDENT = "radius=R,distance=D,tau=T"
CAPITALS = {
    "BENCH.toml": "BENCH.toml is the file of the bench",
    "PLAN.toml": "PLAN.toml is the file of the plan, which the journal does not name",
    "FILL": "FILL is what the detector sees: under, over or beam:W,R",
    "VALUE": "VALUE+-U is the certified reflectance factor at these angles",
    "V+-U --": "V+-U is the signal of the standard, which the file does not hold",
    "radius=R": "R and D are radius and distance of the aperture, and T is the transmittance of the filter",
}


def described_raw(path: Path) -> tuple[dict[str, Any], Iterator[Any]] | None:
    """What a file of raw readings holds, as plain data and for people; None for a file of anything else.

    Raises FormatError, with the place, for a damaged one.
    """
    if (reader := reader_of_raw(path)) is None:
        return None
    if reader.read is journal.read:
        content = read_journal(path)
        record = _of_journal(path, content, reader)
        return record, _journal_lines(record)
    record = {"file": str(path), "kind": READINGS, "format": reader.title} | _of_readings(reader.read(path))
    record["next"] = _reduction(path, record)
    return record, _reading_lines(record)


def _of_journal(path: Path, content: Content, reader: Reader) -> dict[str, Any]:
    """What a journal holds; of its readings what is known of those that gave a number."""
    taken = [one for one in content.records if "kind" in one]
    torn = path.with_name(f"{path.name}.torn")
    last = taken[-1] if taken else None
    left = [step.kind for k, step in enumerate(content.plan.steps) if k not in content.done]
    stopped = [one["note"] for one in content.records if one.get("event") == "stopped" and "note" in one]
    record: dict[str, Any] = {"file": str(path), "kind": JOURNAL, "format": reader.title, "plan": content.plan.name}
    record |= {name: value for name, value in measured.record(content, path).items() if name != "log"}
    record |= {
        "left": dict(Counter(left)),
        "last": _last(last) if last else None,
        "stopped": str(stopped[-1]) if stopped and content.records[-1].get("event") == "stopped" else "",
        "torn": content.torn,
        "torn_before": torn.stat().st_size if torn.is_file() else 0,
    }
    known = _known(path, reader) if any(one["value"] is not None for one in taken) else {"by_kind": {}}
    record |= known
    record["next"] = (
        _reduction(path, record) if content.is_complete and known["by_kind"] else _resumption(path, content)
    )
    return record


def _known(path: Path, reader: Reader) -> dict[str, Any]:
    """What the readings of a journal are; FormatError with its name where they cannot be reduced."""
    try:
        return _of_readings(checked(reader.read(path)))
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(path, str(error)) from error


def _of_readings(raw: xr.Dataset) -> dict[str, Any]:
    directed = np.isfinite(raw["theta_i"].values) & np.isfinite(raw["theta_r"].values)
    theta_r = np.where(raw["phi"].values == 0, -1, 1)[directed] * raw["theta_r"].values[directed]
    time = raw["time"].values[np.isfinite(raw["time"].values)]
    return {
        "unit": str(raw["signal"].attrs["units"]),
        "by_kind": dict(Counter(raw["kind"].values.tolist())),
        "theta_i": _distinct(raw["theta_i"].values[directed]),
        "theta_r": [float(theta_r.min()), float(theta_r.max())] if theta_r.size else [],
        "phi_i": _distinct(raw["phi_i"].values),
        "wavelengths": _distinct(raw["wavelength"].values),
        "polarisation": _named(raw["polarisation"].values),
        "ranges": _named(raw["range"].values),
        "filters": _named(raw["filter"].values),
        "seconds": float(time.max() - time.min()) if time.size else None,
        "monitored": bool(np.isfinite(raw["monitor"].values).all()),
        "overloaded": int((raw["overload"].values > 0).sum()),
        "net_of_dark": bool(raw.attrs.get(NET)),
        "stated": {str(k): v for k, v in raw.attrs.items() if k not in ("provenance", "history", NET)},
        "provenance": str(raw.attrs.get("provenance", "")).splitlines(),
    }


def _distinct(values: np.ndarray) -> list[float]:
    found = values[np.isfinite(values)]
    return np.unique(found.round(2)).tolist()  # positions that were read back differ by thousandths


def _named(values: np.ndarray) -> list[str]:
    return [name for name in dict.fromkeys(map(str, values.tolist())) if name]


def _last(record: dict[str, Any]) -> dict[str, Any]:
    """The last reading: what, where, how much and when."""
    direction = record["direction"]
    return {
        "kind": record["kind"],
        "theta_i": direction and direction[0],
        "theta_r": direction and direction[1] * (-1 if direction[2] == 0 else 1),
        "phi": direction and direction[2],
        "value": record["value"],
        "unit": record["unit"],
        "utc": datetime.fromtimestamp(record["t_utc"], UTC).isoformat(timespec="seconds"),
    }


def _resumption(path: Path, content: Content) -> str:
    """The command that measures what is left."""
    plan = content.plan.name or "PLAN.toml"
    return f"gonio measure {shlex.quote(printable(plan))} --bench BENCH.toml --log {shlex.quote(printable(str(path)))}"


def _reduction(path: Path, record: dict[str, Any]) -> str:
    """The command that makes a BRDF of readings, with what only the user knows in capitals."""
    stated, kinds = record["stated"], record["by_kind"]
    fill = "" if stated.get("fill") else " --fill FILL"
    if "incident" in kinds:
        has_aperture = {"aperture_radius", "distance"} <= stated.keys()
        known = has_aperture and ("filter_transmittance" in stated or not record["filters"])
        compared = f"--absolute {'stated' if known else INCIDENT}"
    else:
        compared = f"--standard {STANDARD}" + " --standard-signal V+-U" * ("standard" not in kinds)
    return f"gonio reduce {shlex.quote(printable(str(path)))}{fill} {compared} --out scan.csv"


def _journal_lines(record: dict[str, Any]) -> Iterator[Any]:
    steps = f"{record['done']} of {record['steps']} steps"
    how = f"complete, {steps}" if record["complete"] else f"{steps} are measured"
    yield strong(record["file"], f": {record['format']}, {how}")
    facts = _facts()
    facts.add_row("plan", f"{printable(record['plan']) or 'not named'}, SHA-256 {record['plan_sha256']}")
    facts.add_row("readings", f"{record['readings']} in {_counted(record['sessions'], 'session')}{_repeated(record)}")
    _add_readings(facts, record, "that count")
    if record["left"]:
        facts.add_row("left", _by_kind(record["left"]))
    facts.add_row("last reading", _last_words(record["last"]))
    yield facts
    for note in dict.fromkeys(record["failures"]):
        count = record["failures"].count(note)
        yield f"failed and tried again: {printable(note)} ({_counted(count, 'time')})"
    if record["stopped"]:
        yield f"it was stopped: {printable(record['stopped'])}"
    if record["torn"]:
        yield (
            f"note: {_counted(record['torn'], 'byte')} after the last whole line, which a crash tore or another "
            "process is writing: they count as no reading, and gonio measure sets them aside"
        )
    if record["torn_before"]:
        yield f"{record['file']}.torn holds what crashes tore before, {_counted(record['torn_before'], 'byte')}"
    yield from _next_lines(record)


def _reading_lines(record: dict[str, Any]) -> Iterator[Any]:
    count = sum(record["by_kind"].values())
    yield strong(record["file"], f": {record['format']}, {_counted(count, 'reading')} [{record['unit']}]")
    facts = _facts()
    _add_readings(facts, record, "by kind")
    yield facts
    for line in record["provenance"][:MOST_LINES]:
        yield faint(f"# {line[:LONGEST]}")
    if len(record["provenance"]) > MOST_LINES:
        yield faint(f"# and {len(record['provenance']) - MOST_LINES} more lines; --json has them all")
    yield from _next_lines(record)


def _next_lines(record: dict[str, Any]) -> Iterator[str]:
    """The next command, and what its words in capitals stand for."""
    yield f"next: {record['next']}"
    said = [words for word, words in CAPITALS.items() if word in record["next"]]
    if said:
        yield f"there, {'; '.join(said)}"


def _facts() -> Any:
    facts = table("", "", left=2)
    facts.show_header = False
    facts.columns[1].no_wrap = False
    return facts


def _add_readings(facts: Any, record: dict[str, Any], by_kind: str) -> None:
    """What is known of the readings, a row each."""
    if not record["by_kind"]:
        return
    facts.add_row(by_kind, _by_kind(record["by_kind"]))
    for name, unit in (("theta_i", "deg"), ("phi_i", "deg"), ("wavelengths", "nm"), ("polarisation", "")):
        if record[name]:
            facts.add_row(name, listed(record[name], unit))
    if record["theta_r"]:
        facts.add_row("theta_r", "{:g} to {:g} deg".format(*record["theta_r"]))
    for name in ("ranges", "filters"):
        if record[name]:
            facts.add_row(name, listed(record[name], ""))
    if record["seconds"]:
        facts.add_row("time", f"{record['seconds']:.0f} s")
    facts.add_row("dark", _dark(record))
    if record["overloaded"]:
        facts.add_row("overloaded", _counted(record["overloaded"], "reading"))
    stated = [f"{name} {value}" for name, value in record["stated"].items() if name not in ("plan_sha256", "start_utc")]
    if stated:
        facts.add_row("stated", printable(", ".join(stated))[:LONGEST])


def _dark(record: dict[str, Any]) -> str:
    if record["net_of_dark"]:
        return "subtracted by the instrument"
    return "read" if "dark" in record["by_kind"] else "not read: signals are taken as they are"


def _by_kind(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in counts.items())


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


def _repeated(record: dict[str, Any]) -> str:
    repeated: Sequence[str] = record["repeated"]
    return f", {len(repeated)} repeated in another range" if repeated else ""


def _last_words(last: dict[str, Any] | None) -> str:
    if last is None:
        return "none yet"
    where = "" if last["theta_i"] is None else f" at theta_i {last['theta_i']:.4g}, theta_r {last['theta_r']:.4g} deg"
    value = "no number" if last["value"] is None else f"{last['value']:.5g} {last['unit']}"
    return f"{last['kind']}{where}: {value}, {last['utc']}"

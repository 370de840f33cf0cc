"""The journal: nothing that it held is lost, whatever happens to the process, the disk or the file."""

import json
import random
import re
import subprocess
import sys
import zlib

import pytest

from gonio.acquisition import Conditions, Journal, Layout, Plan, grid, read_journal, readings, run
from gonio.acquisition.plan import Step
from gonio.door.records import line_of, sound_lines
from gonio.files import FormatError
from places import ROOT
from simulated_benches import SMALL, bench, measure


def test_a_line_is_a_checksum_and_json(tmp_path):
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    lines = path.read_bytes().splitlines()
    for line in lines:
        digits, text = line.split(b" ", 1)
        assert int(digits, 16) == zlib.crc32(text)
    head = json.loads(lines[0][9:])
    assert head["plan_sha256"] == SMALL.sha256
    assert head["instrument"]["aperture_radius"] == 4.75
    content = read_journal(path)
    assert content.is_complete
    assert content.plan == SMALL
    record = next(r for r in content.records if r.get("kind") == "sample")
    assert {"i", "step", "t_utc", "t_mono", "stage", "direction", "value", "sd", "n", "range", "filter"} <= set(record)
    assert {"overload", "monitor", "temperature", "shutter", "attempt", "note"} <= set(record)


def test_every_torn_tail_is_kept_aside_and_the_rest_goes_on(tmp_path):
    """Cut the file anywhere within its last lines, with and without garbage behind: what was whole stays."""
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    whole = path.read_bytes()
    ends = [m.end() for m in re.finditer(b"\n", whole)]
    for cut in [*range(ends[-4], ends[-2], 149), ends[5] + 3]:
        for garbage in (b"", b"\0\xff garbage\n", b"00000000 {}\n"):
            path.write_bytes(whole[:cut] + garbage)
            kept = max((e for e in ends if e <= cut), default=0)
            torn = tmp_path / "run.jsonl.torn"
            torn.unlink(missing_ok=True)
            measure(path, bench())
            assert path.read_bytes()[:kept] == whole[:kept]
            tail = whole[kept:cut] + garbage
            assert (torn.read_bytes() if torn.exists() else b"") == tail
            assert read_journal(path).is_complete


def test_a_head_that_a_crash_cut_short_is_no_reason_to_stop(tmp_path):
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    head = path.read_bytes().split(b"\n")[0]
    for length in (0, 3, 9, len(head)):
        path.write_bytes(head[:length])
        measure(path, bench())
        assert read_journal(path).is_complete


@pytest.mark.parametrize("text", ["theta_i,theta_r,brdf\n1,2,3\n", "00000000 {}\n", "\0\1\2", "12345678 {} and more\n"])
def test_a_file_that_is_no_journal_is_not_touched(tmp_path, text):
    path = tmp_path / "scan.csv"
    path.write_text(text)
    with pytest.raises(FormatError, match="no journal"):
        measure(path, bench())
    assert path.read_text() == text
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (Plan(Conditions(dwell=0.1), SMALL.steps, SMALL.skipped), "wavelength is None here and 632.8 there"),
        (Plan(Conditions(wavelength=632.8, dwell=3), SMALL.steps, SMALL.skipped), "dwell is 3.0 here and 0.1 there"),
        (Plan(SMALL.conditions, (*SMALL.steps, Step("dark")), SMALL.skipped), "there are"),
        (
            Plan(SMALL.conditions, (SMALL.steps[0], Step("dark"), *SMALL.steps[2:]), SMALL.skipped),
            "step 2 is dark here",
        ),
        (Plan(SMALL.conditions, SMALL.steps, ()), "the skipped directions differ"),
    ],
)
def test_a_journal_of_another_plan_is_refused_with_the_difference(tmp_path, other, said):
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    before = path.read_bytes()
    with pytest.raises(ValueError, match="is the journal of another plan") as caught:
        measure(path, bench(), other)
    assert said in str(caught.value)
    assert path.read_bytes() == before


def test_a_journal_of_another_instrument_is_refused_with_the_difference(tmp_path):
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    with pytest.raises(ValueError, match=r"distance is 400 here and 500\.0 in the journal"):
        measure(path, bench(stated={"distance": 400}))


def test_two_processes_do_not_write_one_journal(tmp_path):
    path = tmp_path / "run.jsonl"
    with Journal(path, SMALL, bench().described("")), pytest.raises(OSError, match="being written by another process"):
        measure(path, bench())
    measure(path, bench())


@pytest.fixture(scope="module")
def trials():
    """What a process found that kills its own forks and fills its disk: one start of Python for all."""
    line = [sys.executable, ROOT / "tests" / "tools" / "journal_trials.py"]
    done = subprocess.run(line, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_twenty_kills_lose_nothing(trials):
    """SIGKILL at random moments: every whole record stays, every step is read, and none twice."""
    result = trials["killed"]
    assert result["kills"] == 20
    assert result["sessions"] > 10  # or the kills came too early to try anything
    assert (result["lost"], result["doubled"]) == (0, 0)
    assert result["complete"]


def test_a_full_disk_stops_at_once_with_the_shutter_closed(trials):
    """RLIMIT_FSIZE stands for a disk without room: at any size the journal is whole, and goes on when there is room."""
    records = [one["records"] for one in trials["full"]]
    assert records == sorted(set(records))  # it was full early, later and late
    for one in trials["full"]:
        assert one["error"] == "OSError"
        assert ".jsonl" in one["said"]
        assert not one["shutter_open"]
        assert one["tail"] == 0
        assert one["kept"]
        assert one["complete_afterwards"]


def test_readings_are_columns_of_one_row_a_reading(tmp_path):
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    raw = readings(path)
    assert set(raw["kind"].values) == {"sample", "dark", "check"}
    sample = raw.isel(reading=raw["kind"].values == "sample")
    assert sample["signal"].attrs["units"] == "W"
    assert set(zip(sample["theta_i"].values.round(3), sample["theta_r"].values.round(3), strict=True)) >= {(20, 60)}
    assert set(sample["phi"].values) == {0, 180}
    dark = raw.isel(reading=raw["kind"].values == "dark")
    assert dark["theta_i"].isnull().all()
    assert len(set(dark["range"].values)) == 3
    assert (raw["time"].values >= 0).all()
    assert raw.attrs["plan_sha256"] == SMALL.sha256
    assert raw.attrs["fill"] == "under"
    assert raw["attempt"].values.max() >= 1  # the range was changed, and both readings are there


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"t_utc": "x"}, "it has no time"),
        ({"value": "x"}, "its value is 'x'"),
        ({"range": None}, "its range is None"),
        ({"step": 999}, "its step is 999"),
        ({"step": "1"}, "its step is '1'"),
        ({"direction": [1, 2]}, "its direction is [1, 2]"),
        ({"unit": 3}, "its unit is 3"),
        ({"session": True}, "its session is True"),
        ([], "it has no time"),
    ],
)
def test_a_record_that_no_measurement_wrote_is_refused_with_its_line(tmp_path, change, said):
    """Its checksum is right: somebody wrote it by hand, or by a program of his own."""
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    lines = path.read_bytes().splitlines(keepends=True)
    record = json.loads(lines[4][9:])
    lines[4] = line_of(json.dumps(record | change if isinstance(change, dict) else change))
    path.write_bytes(b"".join(lines))
    with pytest.raises(FormatError, match="line 5: is no record of a measurement") as caught:
        readings(path)
    assert said in str(caught.value)


def test_a_head_that_no_measurement_wrote_is_refused(tmp_path):
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    lines = path.read_bytes().splitlines(keepends=True)
    head = json.loads(lines[0][9:])
    for change in ({"plan_sha256": "0"}, {"plan": {}}, {"plan": 3}, {"instrument": 3}, {"format": "x"}):
        path.write_bytes(line_of(json.dumps(head | change)) + b"".join(lines[1:]))
        with pytest.raises(FormatError, match="line 1: is no journal of gonio"):
            readings(path)


def test_a_damaged_journal_is_read_up_to_the_damage(tmp_path):
    """Any byte that differs ends what is read before its line, or leaves no journal; it is never another reading."""
    path = tmp_path / "run.jsonl"
    measure(path, bench())
    whole = path.read_bytes()
    texts = sound_lines(path).texts
    chance = random.Random(3)
    for _ in range(60):
        at = chance.randrange(len(whole))
        path.write_bytes(whole[:at] + bytes([whole[at] ^ chance.randint(1, 255)]) + whole[at + 1 :])
        found = sound_lines(path).texts
        assert found == texts[: len(found)]
        assert len(found) == whole[:at].count(b"\n")
        if found:
            read_journal(path)
        else:
            with pytest.raises(FormatError):
                read_journal(path)


def test_readings_of_nothing_are_refused(tmp_path):
    path = tmp_path / "run.jsonl"
    with Journal(path, SMALL):
        pass
    with pytest.raises(ValueError, match="no reading yet"):
        readings(path)
    with pytest.raises(FormatError, match="there is no such file"):
        readings(tmp_path / "none.jsonl")


def test_attempts_count_from_zero_in_every_step(tmp_path):
    """What a reduction relies on: a row with a larger attempt than the row before repeats that row."""
    path = tmp_path / "run.jsonl"
    measure(path, bench(), grid([20], [0, 10, 20], layout=Layout(dark_every=1)))
    content = read_journal(path)
    raw = readings(content)
    taken = [r for r in content.records if "kind" in r and r["value"] is not None]
    for k, (record, before) in enumerate(zip(taken[1:], taken, strict=False), start=1):
        goes_on = raw["attempt"].values[k] > raw["attempt"].values[k - 1]
        assert goes_on == (record["attempt"] > 0)
        assert not goes_on or record["step"] == before["step"]


def test_watching_reads_while_another_writes(tmp_path):
    path = tmp_path / "run.jsonl"
    on = bench()
    with Journal(path, SMALL, on.described("")) as journal:
        for count, _ in enumerate(run(SMALL, on, journal), start=1):
            assert sum("kind" in record for record in read_journal(path).records) == count

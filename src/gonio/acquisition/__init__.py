"""Measuring: a plan, the devices of a bench, a journal that survives every crash, and a simulated bench.

The plan is data and the journal is the truth: what is left to do is the plan without what the journal holds. Models are
handed in; drivers of real devices are imported only when a bench names them.
"""

from gonio.acquisition.benches import read_bench
from gonio.acquisition.device import Axis, Bench, Detector, DeviceError, InPlane, Reading, Selector, Shutter
from gonio.acquisition.journal import Journal, read_journal
from gonio.acquisition.layout import Layout, grid, planned
from gonio.acquisition.plan import Conditions, Plan, Step, read_plan
from gonio.acquisition.readings import readings
from gonio.acquisition.run import run

__all__ = [
    "Axis",
    "Bench",
    "Conditions",
    "Detector",
    "DeviceError",
    "InPlane",
    "Journal",
    "Layout",
    "Plan",
    "Reading",
    "Selector",
    "Shutter",
    "Step",
    "grid",
    "planned",
    "read_bench",
    "read_journal",
    "read_plan",
    "readings",
    "run",
]

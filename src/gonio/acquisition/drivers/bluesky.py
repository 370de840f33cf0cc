"""A plan of gonio as messages of bluesky, for laboratories whose devices a RunEngine runs already.

    RE(messages(read_plan("plan.toml"), table=table, arm=arm, detectors=[meter, monitor], shutter=shutter), print)

The RunEngine then measures, and what it writes are its documents, one stream for each kind of reading. Its checkpoints
live in memory: what must survive a power cut is measured by `gonio measure`, whose journal does. Bluesky (BSD-3) comes
with the extra `gonio[bluesky]`.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from bluesky import plan_stubs, preprocessors

from gonio.acquisition.device import InPlane
from gonio.acquisition.plan import Plan, Step

OPEN, CLOSED = 1, 0  # what a shutter is set to, unless it is told otherwise
Messages = Iterator[Any]


def messages(
    plan: Plan,
    *,
    table: Any,
    arm: Any,
    detectors: Sequence[Any],
    shutter: Any = None,
    states: tuple[Any, Any] = (OPEN, CLOSED),
    prepare: Callable[[Step], Messages] | None = None,
    zeros: tuple[float, float] = (0.0, 0.0),
) -> Messages:
    """Messages for a RunEngine that take every step of a plan, in one run whose start document names the plan.

    table, arm, shutter: what bluesky can set. detectors: what it can trigger and read. states: of the shutter when it
    is open and closed. prepare: messages before a step, such as those that change the filter or the sample; without it
    a plan may have steps of sample, check and dark alone. zeros: of table and arm [deg].
    The shutter is closed at the end, however it comes. Raises ValueError for a step that needs `prepare` or lies out of
    plane, and for darks without a shutter.
    """
    stage = InPlane(table, arm, *zeros)
    for step in plan.steps:
        stage.positions(step)
        if prepare is None and step.kind not in ("sample", "check", "dark"):
            raise ValueError(f"the plan has steps of {step.kind}: give prepare, which changes what they need")
        if shutter is None and step.kind == "dark":
            raise ValueError("the plan has darks: give a shutter")
    about = {"plan_name": "gonio", "plan_sha256": plan.sha256, "wavelength": plan.conditions.wavelength}

    def closed() -> Messages:
        if shutter is not None:
            yield from plan_stubs.abs_set(shutter, states[1], wait=True)

    def steps() -> Messages:
        for step in plan.steps:
            yield from plan_stubs.checkpoint()
            if step.kind == "dark":
                yield from closed()
            moves = [part for name, to in stage.positions(step).items() for part in (stage.axes[name], to)]
            if prepare is not None:
                yield from prepare(step)
            if moves:
                yield from plan_stubs.mv(*moves)
                yield from plan_stubs.sleep(plan.conditions.settle)
            if shutter is not None and step.kind != "dark":
                yield from plan_stubs.abs_set(shutter, states[0], wait=True)
            yield from plan_stubs.trigger_and_read([*detectors, table, arm], name=step.kind)

    run: Messages = preprocessors.finalize_wrapper(preprocessors.run_wrapper(steps(), md=about), closed)
    return run

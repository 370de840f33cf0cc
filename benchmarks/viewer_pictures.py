"""The pictures of docs/howto/viewer.md: the page of `gonio view` in six states, as Chromium draws it.

    python benchmarks/viewer_pictures.py SCANS FOLDER

SCANS holds the measured scans; FOLDER is where viewer-*.png are written, of few colours, so that each is small. Needs
Playwright and an installed Chromium (the tests' own packages). Look at each picture that changes.
"""

import contextlib
import io
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

import gonio

ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader"]
CHROMIUM = "/usr/bin/chromium"
LARGEST = 200_000  # bytes of a picture
SETTLED = 2500  # ms until all is drawn finely
BLACK, PAINT = "ualoft_aeroglaze.csv", "rgl_colodur_napoli_4f.csv"
TWO = ("ualoft_anoblack_ec1_al6061.csv", "ualoft_anoblack_nite_steel.csv")
MODEL = "gonio-best"
# The page draws as finely as the graphics are quick: with this clock they are.
QUICK = "{ let now = 0; performance.now = () => (now += 1e-3); }"


@dataclass(frozen=True)
class State:
    """A picture: what is opened, how the page is shown, and what is done on it before.

    clip: the elements that the picture is of, the page as it fits the window unless some are named.
    """

    name: str
    arguments: tuple[str, ...]
    script: str = ""
    clip: tuple[str, ...] = ()
    size: tuple[int, int] = (1280, 800)
    scheme: str = "light"
    sharp: int = 1


def states(scans: Path, fits: Path) -> list[State]:
    """The six, in the order of the page."""
    black, paint = str(scans / BLACK), str(scans / PAINT)
    fitted = (black, "--solution", str(fits / "black"))
    return [
        State("fit", fitted),
        State("sliders", (black, "--model", "ggx", "--set", "width=0.3"), "actions.move(2, 0.42); actions.snap();"),
        State(
            "surface",
            (paint, "--solution", str(fits / "paint")),
            "store.set({ cell: 3, mapView: 'both' });",
            ("#map", "#lobe", "#sphere"),
            size=(1610, 800),
        ),
        State(
            "two",
            (*(str(scans / name) for name in TWO), "--diff", "--set", "width=0.3"),
            "actions.chooseModel('model', 'ggx');",
        ),
        State("phone", fitted, size=(360, 740), sharp=2),
        State("dark", fitted, "store.set({ quantity: 'pif' });", scheme="dark", size=(1280, 1230)),
    ]


def main() -> None:
    scans, folder = map(Path, sys.argv[1:])
    with tempfile.TemporaryDirectory() as kept, sync_playwright() as playwright:
        fits = Path(kept)
        for name, scan, model in (("black", BLACK, MODEL), ("paint", PAINT, "ggx")):
            (fits / name).mkdir()
            gonio.fit(gonio.read(scans / scan), model).save(fits / name / "solution.nc")
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for state in states(scans, fits):
            with served(state.arguments) as address:
                path = folder / f"viewer-{state.name}.png"
                path.write_bytes(small(taken(browser, address, state)))
                print(f"{path}: {path.stat().st_size / 1000:.0f} kB", flush=True)


@contextlib.contextmanager
def served(arguments: tuple[str, ...]) -> Iterator[str]:
    """The address that `gonio view` prints."""
    command = [sys.executable, "-m", "gonio", "view", *arguments, "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        try:
            yield program.stdout.readline().strip()
        finally:
            program.terminate()


def taken(browser: Browser, address: str, state: State) -> bytes:
    """What the page shows, as PNG."""
    width, height = state.size
    options = {"viewport": {"width": width, "height": height}, "color_scheme": state.scheme}
    with contextlib.closing(browser.new_page(**options, device_scale_factor=state.sharp)) as page:
        page.add_init_script(QUICK)
        page.goto(address)
        page.wait_for_selector("html[data-ready=true]")
        page.evaluate(f"async () => {{ const {{ store, actions }} = gonio; {state.script} }}")
        page.wait_for_timeout(SETTLED)
        if not state.clip:
            return page.screenshot()
        page.set_viewport_size({"width": width, "height": 2 * height})
        page.wait_for_timeout(SETTLED)
        return page.screenshot(clip=around(page, state.clip))


def around(page: Page, parts: tuple[str, ...]) -> dict[str, float]:
    """The smallest rectangle about some elements."""
    boxes = [page.locator(part).bounding_box() for part in parts]
    left, top = (min(box[side] for box in boxes) for side in ("x", "y"))
    right = max(box["x"] + box["width"] for box in boxes)
    bottom = max(box["y"] + max(box["height"], 1) for box in boxes)
    return {"x": left - 4, "y": top - 4, "width": right - left + 8, "height": bottom - top + 8}


def small(picture: bytes) -> bytes:
    """The same with a palette, of as many colours as LARGEST allows."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    for colours in (256, 128, 64):
        out = io.BytesIO()
        image.quantize(colours, dither=Image.Dither.NONE).save(out, "PNG", optimize=True)
        if out.tell() < LARGEST:
            return out.getvalue()
    raise ValueError(f"a picture has more than {LARGEST} bytes")


if __name__ == "__main__":
    main()

"""Shaders that no test can run are printed as they were when Cycles and wgpu ran them (tests/reference/peers), and so
is what Mitsuba runs.

Where the text of a model changes, run the crosscheck of its language again, then renew what is kept:
GONIO_RENEW_PRINTED=1 python -m pytest tests/exporting/test_kept.py
"""

import hashlib
import json
import os
from pathlib import Path

import pytest

from gonio import catalogue
from gonio.exporting.languages.drjit import DRJIT
from gonio.exporting.languages.language import Writer
from gonio.exporting.languages.osl import OSL_LANGUAGE
from gonio.exporting.languages.wgsl import WGSL_LANGUAGE
from gonio.model import sampler_of
from gonio.symbols.formula import draw_of, formula_of
from gonio.symbols.program import staged, whole

KEPT = Path(__file__).with_name("kept") / "printed.json"
LANGUAGES = {"drjit": DRJIT, "osl": OSL_LANGUAGE, "wgsl": WGSL_LANGUAGE}
DRAWS = ("drjit",)  # in which samplers are printed, too
# Together they have every operation: quadratures, special functions, stacks, powers, choices.
MODELS = (
    *("lambert", "ggx", "gonio-best", "cauchy-lorentz-reciprocal", "student-t", "exponential-power", "he-torrance"),
    *("priest-mueller", "rayleigh-rice", "beckmann", "abg", "hapke", "ross-li", "disney"),
)


def printed(language: str, model: str) -> str:
    """All that a shader of a model has but its heading, as a digest."""
    writer, formula = Writer(LANGUAGES[language]), formula_of(catalogue[model])
    terms = catalogue[model].terms.values() if language in DRAWS else ()
    drawn = [whole(draw_of(sampler, term)) for term in terms if (sampler := sampler_of(term)) is not None]
    lines = [
        line
        for program in (staged(formula), whole(formula), *drawn)
        for stage in program.stages
        for line in (*writer.stage(stage), *writer.results(stage))
    ]
    own = writer.language
    words = [own.identifier(name) for name in ("u", "v", "N", "P", "I", "width", "loop", "var", "fn")]
    numbers = [own.literal(value) for value in (0.1, 1e-300, 1e300, 3.0, 1e-38, True, False)]
    text = "\n".join([*writer.shared(), *lines, *words, *numbers])
    return hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_was_run_is_what_is_printed(language):
    found = {model: printed(language, model) for model in MODELS}
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    if os.environ.get("GONIO_RENEW_PRINTED"):
        KEPT.write_text(json.dumps({**kept, language: found}, indent=1) + "\n", encoding="utf-8")
        pytest.skip("what is kept was renewed")
    assert found == kept[language]

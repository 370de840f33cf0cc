"""Dr.Jit as the plugin needs it: sums as functions that may run as loops, and functions that work on every backend."""

from collections.abc import Sequence
from typing import ClassVar

from gonio.exporting.languages.drjit import PRELUDE as QUOTIENT
from gonio.exporting.languages.drjit import DrJit


class Kernel(DrJit):
    """Dr.Jit with sums by `_sum` and constant arrays by `_Table`, both in PRELUDE."""

    # Dr.Jit 1.5 has these too. The hyperbolic ones, asin and acos fail on arrays without a compiler where all elements
    # take one branch; atan2 and atan are good to 7e-7 alone, and end the process with LLVM 14 to 16.
    missing = frozenset({"erfc", "expm1", "log1p", "sinh", "tanh", "asinh", "acosh", "atanh"})
    functions: ClassVar = {**DrJit.functions, **{name: f"_{name}" for name in ("asin", "acos", "atan", "atan2")}}

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A function of the index, and the sum of what it gives."""
        body = [f"{self.indent}{line}" for line in (*inside, f"return {added}")]
        return [f"def of_{total}({index}):", *body, f"{total} = _sum(of_{total}, {size})"]

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """An array of the module, which an index of Dr.Jit can pick from."""
        opening, *rows, _ = super().table(name, numbers)
        return [f"{opening[:-1]}_Table((", *rows, "))"]


KERNEL = Kernel()

PRELUDE = (
    QUOTIENT
    + '''

def _atan2(y, x):
    steep = dr.abs(y) > dr.abs(x)
    least, most = dr.select(steep, dr.abs(x), dr.abs(y)), dr.select(steep, dr.abs(y), dr.abs(x))
    ratio = least / dr.select(most == 0, 1.0, most)
    far = ratio > 0.41421356
    tan = dr.select(far, (ratio - 1.0) / (ratio + 1.0), ratio)  # of an angle less pi/4 where it is far
    tan = tan / (1.0 + dr.sqrt(1.0 + tan * tan))  # of half the angle, below 0.2
    s = tan * tan
    series = 1.0 - s * (1 / 3 - s * (1 / 5 - s * (1 / 7 - s * (1 / 9 - s / 11))))
    angle = 2.0 * tan * series + dr.select(far, math.pi / 4, 0.0)
    angle = dr.select(steep, math.pi / 2 - angle, angle)
    angle = dr.select(x < 0, math.pi - angle, angle)
    return dr.select(y < 0, -angle, angle)


def _atan(x):
    return _atan2(x, 1.0)


def _asin(x):
    return _atan2(x, dr.sqrt((1.0 - x) * (1.0 + x)))


def _acos(x):
    return _atan2(dr.sqrt((1.0 - x) * (1.0 + x)), x)


def _sum(body, count):
    total = 0.0
    for k in range(count):
        total = total + body(k)
    return total


class _Table:
    """Constant numbers."""

    def __init__(self, numbers):
        self.numbers, self.arrays = numbers, {}

    def __getitem__(self, k):
        if isinstance(k, int):
            return self.numbers[k]
        array = (dr.float64_array_t if PRECISE else dr.float32_array_t)(type(k))
        if array not in self.arrays:
            self.arrays[array] = array(self.numbers)
        return dr.gather(array, self.arrays[array], k)
'''
)

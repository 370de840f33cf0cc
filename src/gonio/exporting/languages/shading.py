"""What shading languages share: single precision, and functions of vectors and of short arrays."""

from abc import abstractmethod
from collections.abc import Sequence

from gonio.exporting.languages.single import Single

Arguments = Sequence[tuple[str, int]]  # names, with the length of an array, or VECTOR
VECTOR = 0
OWN = frozenset({"w_i", "w_r", "pre", "inc", "values", "result"})  # arguments of the functions


class Shading(Single):
    """The words of a shading language that functions of both directions need."""

    tables_are_local = False  # whether a constant array can only stand in a function

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A for loop."""
        body = [f"{self.indent}{line}" for line in (*inside, f"{total} += {added};")]
        return [f"float {total} = 0.0;", f"for (int {index} = 0; {index} < {size}; ++{index}) {{", *body, "}"]

    @abstractmethod
    def gives_number(self, name: str, arguments: Arguments, inside: Sequence[str], result: str) -> list[str]:
        """A function that gives one number."""

    @abstractmethod
    def gives_array(self, name: str, arguments: Arguments, inside: Sequence[str], results: Sequence[str]) -> list[str]:
        """A function that gives an array of numbers."""

    @abstractmethod
    def takes_array(self, name: str, size: int, function: str, arguments: Sequence[str]) -> list[str]:
        """A new array in a function, which holds what another function gives."""

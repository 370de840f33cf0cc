"""Programs whose files have no public grammar: what to do in place of a file."""

from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Request, Target

_WHY = (
    "has no public description of its files, so none is written: write a card by --to {cards} and type its numbers in"
)


def _none(subject: Subject, request: Request) -> Made:  # noqa: ARG001
    raise ValueError(f"{request.out}: this program takes no file of gonio")


def _refused(name: str, title: str, cards: str) -> Target:
    return Target(
        name, title, (), "nothing: a card has the numbers to type in", _none, refused=_WHY.format(cards=cards)
    )


TRACEPRO = _refused("tracepro", "TracePro", "abg")
ASAP = _refused("asap", "ASAP", "harvey-shack")
CODE_V = _refused("code-v", "Code V", "abg or --to harvey-shack")

"""`gonio formats`: the file formats, and what each can hold."""

from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.views import formats

EXAMPLES = (
    Example("gonio formats", "List the formats"),
    Example("gonio formats --json -", "The same for a program"),
    Example("gonio formats --json formats.json", "The same into a file"),
)


def command(output: OutputOptions) -> None:
    """List the file formats, and what each can hold."""
    output.show(formats.records(), (formats.table(), formats.LEGEND, formats.programs()))

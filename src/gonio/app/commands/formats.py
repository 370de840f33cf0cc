"""`gonio formats`: the file formats, and what each can hold."""

from gonio.app.options import OutputOptions
from gonio.app.views import formats


def command(output: OutputOptions) -> None:
    """List the file formats: what is read and written, and what each can hold."""
    output.show(formats.records(), (formats.table(), formats.LEGEND))

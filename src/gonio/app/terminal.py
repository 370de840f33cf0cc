"""The application that the commands register with."""

import typer

app = typer.Typer(
    help="From goniometer readings to a BRDF, the analytic model that explains it, and how sure that is.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

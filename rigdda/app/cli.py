"""The command line: `rigdda sites | simulate | design | reprice | study | train | ...`.

The commands are in `rigdda.app.commands`, with one module for each, and are listed in `COMMANDS`.
"""

from __future__ import annotations

import errno
import io
import sys
import warnings
from collections.abc import Sequence

import click

from rigdda.app.commands.check import check
from rigdda.app.commands.corridor import corridor
from rigdda.app.commands.dataset import dataset
from rigdda.app.commands.design import design
from rigdda.app.commands.evaluate import evaluate
from rigdda.app.commands.exam import exam
from rigdda.app.commands.fidelity import fidelity
from rigdda.app.commands.fit import fit
from rigdda.app.commands.new import new
from rigdda.app.commands.open import open_page
from rigdda.app.commands.repeat import repeat
from rigdda.app.commands.replay import replay
from rigdda.app.commands.report import report
from rigdda.app.commands.reprice import reprice
from rigdda.app.commands.schema import schema
from rigdda.app.commands.sensitivity import sensitivity
from rigdda.app.commands.simulate import simulate
from rigdda.app.commands.sites import sites
from rigdda.app.commands.study import study
from rigdda.app.commands.train import train
from rigdda.app.commands.validate import validate
from rigdda.app.terminal import (
    Stopped,
    fail,
    once,
)

BAD_PATH = (
    FileNotFoundError, FileExistsError, NotADirectoryError, IsADirectoryError, PermissionError,
)  # fmt: skip
"""Errors of the operating system that are caused by a path which the user gave."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    The codes are 0 for success, 2 for bad input, 1 for a failure during the run and 130 for an
    interruption. With every code except 0, one line is written on standard error.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # the locale may lack letters of a name
    try:
        with warnings.catch_warnings():
            warnings.showwarning = once()
            return _run(sys.argv[1:] if argv is None else argv)
    except click.Abort:
        return fail("interrupted", 130)
    except click.ClickException as error:
        return fail(error.format_message(), error.exit_code)
    except Stopped as stop:
        return fail(str(stop), stop.code)
    except OSError as error:
        bad = isinstance(error, BAD_PATH) or error.errno == errno.ENAMETOOLONG
        return fail(_bad_path(error), 2) if bad else fail(str(error), 1)
    except Exception as error:
        from rigdda import BadInput, Error

        if not isinstance(error, Error):
            raise
        return fail(str(error), 2 if isinstance(error, BadInput) else 1)


def _bad_path(error: OSError) -> str:
    """Return the message of an error that is caused by a path: the path and what to do."""
    from rigdda import BadInput

    if error.filename is None:
        return str(error)
    hint = f"name a file or folder that exists and that you may read or write ({error.strerror})"
    return str(BadInput("path", error.filename, hint))


def _run(argv: Sequence[str]) -> int:
    """Run a command; its arguments are the object of the context, from which they are recorded."""
    typed = list(argv)
    return cli.main(typed, prog_name="rigdda", standalone_mode=False, obj=list(typed)) or 0


def _version(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        from rigdda import __version__

        click.echo(f"rigdda {__version__}")
        context.exit()


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version,
              help="Show the version.")  # fmt: skip
@click.pass_context
def cli(context: click.Context) -> None:
    """Simulate rockfall on a slope, design barriers and replay releases."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


COMMANDS = (
    sites, new, check, schema, simulate, fidelity, replay, repeat, design, report, reprice, study,
    corridor, fit, sensitivity, train, evaluate, exam, dataset, validate, open_page,
)  # fmt: skip
"""All commands."""

for command in COMMANDS:
    cli.add_command(command)


if __name__ == "__main__":
    sys.exit(main())

"""Record of the commands that wrote a results folder: `run.json`.

A results folder records how it was made: the command as it was typed, every option, the seed, the
versions and the site as it was used. With the record, the command can be repeated, and
`rigdda report` can document its results.
"""

from __future__ import annotations

import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from rigdda import BadInput, Site
from rigdda.envs.replay_record import Versions
from rigdda.files import atomic

RECORD_FILE = "run.json"
"""Name of the file in a results folder."""


class RunRecord(msgspec.Struct, kw_only=True):
    """Record of one command that wrote into a results folder.

    Parameters
    ----------
    command : str
        Name of the command, such as "design".
    arguments : list of str
        Arguments as they were typed, without the name of the program.
    options : dict
        Value of every argument and option of the command, also of those with their defaults.
    started, ended : str
        Date and time in UTC, ISO 8601; `ended` is empty while the command runs and after an
        interruption.
    versions : Versions
        Versions of the programs.
    site : str
        The site as it was used, as TOML with all defaults; empty if the command has no site.
    files : list of str
        Names of the files that the command wrote into the folder.
    findings : list of str
        Findings and notes that the command printed, one sentence or more each.
    """

    command: str
    arguments: list[str]
    options: dict[str, Any]
    started: str
    ended: str = ""
    versions: Versions
    site: str = ""
    files: list[str] = []
    findings: list[str] = []

    @classmethod
    def begin(
        cls, command: str, arguments: list[str], options: dict[str, Any], site: Site | None
    ) -> RunRecord:
        """Return the record of a command that begins now."""
        return cls(
            command=command,
            arguments=arguments,
            options={name: _plain(value) for name, value in options.items()},
            started=_now(),
            versions=Versions.of_today(),
            site="" if site is None else as_toml(site),
        )

    def end(self, files: list[str]) -> None:
        """Note the time at which the command ended and the files that it wrote."""
        self.ended, self.files = _now(), files

    def write(self, folder: Path) -> None:
        """Write the record into a results folder, beside those of other commands."""
        write_records(folder, read(folder) | {self.command: self})


def read(folder: Path) -> dict[str, RunRecord]:
    """Return the records in a results folder by command; empty if there is no record.

    Raises
    ------
    BadInput
        If the file is damaged or was written by another version.
    """
    file = folder / RECORD_FILE
    if not file.is_file():
        return {}
    try:
        return msgspec.json.decode(file.read_bytes(), type=dict[str, RunRecord])
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        hint = f"this file is damaged: name another folder ({error})"
        raise BadInput("RESULTS", str(file), hint) from None


def write_records(folder: Path, records: dict[str, RunRecord]) -> None:
    """Write the records of a results folder; without any, there is no file."""
    if not records:
        (folder / RECORD_FILE).unlink(missing_ok=True)
        return
    text = msgspec.json.format(msgspec.json.encode(records), indent=2)
    with atomic(folder / RECORD_FILE) as part:
        part.write_bytes(text + b"\n")


def check_terms(asked: dict[str, Any], found: dict[str, Any], what: str) -> None:
    """Check that a command continues what is in its folder on the same terms.

    Parameters
    ----------
    asked, found : dict
        Terms of the command, and those that are recorded in the folder.
    what : str
        What the folder contains, such as "the training in runs/train".

    Raises
    ------
    BadInput
        If they differ; the message names the first term that does.
    """
    for name in (*asked, *found):
        own, other = asked.get(name), found.get(name)
        if own != other:
            raise BadInput(name, own, f"{what} has {other}: name another folder with --out")


def as_toml(site: Site) -> str:
    """Return a site as the text of a site file with all defaults; empty if that is impossible."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "site.toml"
        try:
            site.save(file)
        except BadInput:
            return ""
        return file.read_text(encoding="utf-8")


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _plain(value: Any) -> Any:
    """Return the value of an option in a form that JSON can represent."""
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value if isinstance(value, str | int | float | bool | None) else str(value)

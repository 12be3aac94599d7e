"""File access: reading of UTF-8 text, atomic writing, and files of unfinished jobs."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rigdda.errors import BadInput


def read(field: str, path: Path) -> str:
    """Return the text of a UTF-8 file, without a byte order mark.

    Raises
    ------
    BadInput
        If the file cannot be read or is not UTF-8; the message names `field`.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise BadInput(field, str(path), f"name a file to read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        hint = f"save it as UTF-8: byte {error.start} is not ({error.reason})"
        raise BadInput(field, str(path), hint) from None


def is_file(path: str | os.PathLike[str]) -> bool:
    """Return whether there is a file of this name; a name that no file can have is none.

    `Path.is_file` raises an OSError if a name is too long.
    """
    return os.path.isfile(path)


def is_folder(path: str | os.PathLike[str]) -> bool:
    """Return whether there is a folder of this name; a name that no folder can have is none."""
    return os.path.isdir(path)


LONGEST_NAME = 200
"""Greatest length of the name of a file or folder, without an ending [bytes]; operating systems
allow 255."""

PART = "part-"
"""Beginning of the suffix of a temporary file."""


def remove_parts(folder: Path) -> None:
    """Remove the temporary files of `atomic` that killed processes left in a results folder.

    Its subfolders are searched, too, but not theirs, since a user may name a large tree.
    """
    name = f".*.{PART}????????"
    for part in (*folder.glob(name), *folder.glob(f"*/{name}")):
        with suppress(OSError):  # the file of another user does no harm
            part.unlink()


def vector_twin(name: str) -> str:
    """Return the name of the vector picture beside a picture, or the name of any other file."""
    return f"{name.removesuffix('.png')}.svg" if name.endswith(".png") else name


def remove_results(folder: Path, names: Iterable[str]) -> None:
    """Remove results of an earlier run, and the vector pictures beside them."""
    for name in names:
        (folder / name).unlink(missing_ok=True)
        (folder / vector_twin(name)).unlink(missing_ok=True)


UNFINISHED = ".unfinished"
"""Name of the folder in a results folder from which a job that was killed continues."""


def remove_unfinished(folder: Path) -> None:
    """Remove what a job kept in its results folder to continue; its tables are written."""
    shutil.rmtree(folder / UNFINISHED, ignore_errors=True)


@contextmanager
def atomic(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path that replaces `path` when the block ends without an error.

    The temporary file is in the same folder, so that `path` is always either the old or the
    complete new file.

    Raises
    ------
    OSError
        If the file cannot be written; the error names `path` or its folder.
    """
    target = Path(path)
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.{PART}")
    os.close(handle)
    part = Path(name)
    try:
        yield part
        umask = os.umask(0)
        os.umask(umask)
        part.chmod(0o666 & ~umask)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)

"""What `rigdda check` finds on the site of a page without releases, computed by a thread."""

from __future__ import annotations

import threading
import traceback
from pathlib import Path
from typing import NamedTuple

from rigdda import Error, Site
from rigdda.app.page.loading import IMPORTING


class Found(NamedTuple):
    """What was found on a site."""

    odd: tuple[str, ...]
    """What looks odd, each in a sentence."""
    placeholders: tuple[str, ...]
    """Values of the site file that are marked as placeholders."""
    fault: str = ""
    """Why nothing was checked; empty if it was."""


class Findings:
    """Checks of a site that a thread computes, so that the page does not wait for them.

    Attributes
    ----------
    found : Found or None
        What was found on the site that was asked for last; None until it is checked.
    """

    def __init__(self) -> None:
        self.found: Found | None = None
        self._asked: Site | None = None
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def ask(self, site: Site, file: Path) -> None:
        """Check a site, which is read from a file."""
        with self._lock:
            if site is self._asked:
                return
            self._asked, self.found = site, None
        self._thread = threading.Thread(
            target=self._work, args=(site, file), name="findings", daemon=True
        )
        self._thread.start()

    def stop(self) -> None:
        """Forget the site that was asked for last."""
        with self._lock:
            self._asked = None

    def join(self) -> None:
        """Wait until the site is checked."""
        if self._thread is not None:
            self._thread.join()

    def _work(self, site: Site, file: Path) -> None:
        # imported by the thread: the page opens sooner
        with IMPORTING:
            from rigdda.app import site_check, site_oddities

        try:
            written = site_oddities.written_events(str(file))
            odd = site_oddities.oddities(site, (), written)
            found = Found(tuple(odd), tuple(site_check.placeholders(str(file))))
        except (Error, OSError) as error:
            found = Found((), (), str(error))
        except Exception as error:  # shown on the page
            traceback.print_exc()
            found = Found((), (), f"{type(error).__name__}: {error}")
        with self._lock:
            if site is self._asked:
                self.found = found

"""The scorer: it runs an entry in processes of its own and verifies what the entry submits.

For each budget and seed, a new process works on all sites and corridors, in the order of the
budgets. When all layouts of a budget are fixed, the seeds of their verification are computed from a
hash of these layouts. The layouts and the references are evaluated on the same releases.
"""

from __future__ import annotations

import hashlib
import importlib.machinery
import math
import multiprocessing
import os
import resource
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rigdda import MECHANICS, BadInput, Layout, __version__
from rigdda.agents.designers import rule
from rigdda.agents.designers.store import Store
from rigdda.app.exam import entrant
from rigdda.app.exam.counter import ReleaseCounter, from_tables, problems_of
from rigdda.app.exam.entrant import CORRIDOR_ENTRY, SITE_ENTRY
from rigdda.app.exam.messages import (
    AnyRequest,
    FailRequest,
    FlagRequest,
    Option,
    ReadyRequest,
    ReleaseRequest,
    SubmitRequest,
    Tables,
    TaskOrder,
    decode_request,
    encode,
)
from rigdda.app.exam.specification import ExamPart, References
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.observation import observe
from rigdda.files import atomic

Tick = Callable[[int, str], None]

Functions = Mapping[Option, str]
"""Names of the functions by their options; that for corridors may be empty."""

SUBMISSIONS, IDENTITY, EVALUATIONS = "submissions.json", "exam.json", "evaluations.jsonl"
"""Files of a run from which it continues."""

TOLERANCE = 1e-6
"""Relative tolerance of the construction cost of a corridor."""


class Submission(msgspec.Struct, frozen=True):
    """What an entry submitted for a task.

    Parameters
    ----------
    name : str
        Name of the site or corridor.
    budget : int
        Releases per section that the entry was given.
    layouts : list of layouts
        One for each section, as the tables of layout files; empty if what was submitted is invalid.
    used, refused : int
        Number of releases simulated, and number of requests beyond the budget.
    flags : list of str
        Rules that the entry broke.
    seconds : float
        Processor time of the entry's process, without the simulations of the scorer [s]; that of
        all tasks of a process is divided evenly.
    """

    name: str
    budget: int
    layouts: list[Tables]
    used: int
    refused: int
    flags: list[str]
    seconds: float = 0.0

    def built(self) -> tuple[Layout, ...]:
        """Return the layouts."""
        return tuple(from_tables(own) for own in self.layouts)


@dataclass(frozen=True, slots=True)
class ExamScore:
    """Result of a task.

    Parameters
    ----------
    submission : Submission
        What was submitted.
    corridor : bool
        Whether the task is a corridor.
    evaluations, references : tuple of Evaluation
        Evaluations of the submitted layouts and of the reference, of each section, on the same
        releases.
    lengths : tuple of float
        Lengths of the sections [m]; 1 for a site.
    score : float
        1 - (Z - Z_reference) / (Z_random - Z_reference) [-]: 1 for the reference, 0 for random
        layouts. The numerator is measured on the same releases, the denominator is recorded.
    distance : float
        (Z - Z_reference) / (Z_nothing - Z_reference) [-]: 0 for the reference, 1 for no barriers.
    """

    submission: Submission
    corridor: bool
    evaluations: tuple[Evaluation, ...]
    references: tuple[Evaluation, ...]
    lengths: tuple[float, ...]
    score: float
    distance: float

    @property
    def objective(self) -> float:
        """Annual cost [EUR per metre and year] of a site, or [EUR/year] of a corridor."""
        return _total(self.lengths, self.evaluations)

    @property
    def cost(self) -> float:
        """Construction cost [EUR per metre] of a site, or [EUR] of a corridor."""
        pairs = zip(self.lengths, self.evaluations, strict=True)
        return math.fsum(length * e.cost for length, e in pairs)


def _total(lengths: Sequence[float], found: Sequence[Evaluation]) -> float:
    """Return the sum of length times Z."""
    return math.fsum(at * e.objective for at, e in zip(lengths, found, strict=True))


class Scorer:
    """Runs an entry and scores it.

    Parameters
    ----------
    asked : ExamPart
        The part of the exam.
    references : References
        The recorded references.
    entry, corridor_entry : str
        Names of the functions, "package.module:function". The second may be empty.
    folder : path
        Folder of the run, from which it continues.
    tick : callable
        Called with the number of completed tasks and a description.
    """

    def __init__(
        self,
        asked: ExamPart,
        references: References,
        entry: str,
        corridor_entry: str,
        folder: Path,
        tick: Tick = lambda done, words: None,
    ):
        self.asked, self.references, self.folder, self.tick = asked, references, folder, tick
        self.functions: Functions = {SITE_ENTRY: entry, CORRIDOR_ENTRY: corridor_entry}
        self._store = Store(folder / EVALUATIONS)
        self._done: dict[tuple[str, int], Submission] = {}
        self.resumed = 0

    def run(self) -> list[ExamScore]:
        """Return the scores of all tasks.

        Raises
        ------
        BadInput
            If the folder belongs to another run, the entry cannot be imported, raises an error or
            ends its process.
        """
        self.play()
        return self.verify()

    def play(self) -> None:
        """Let the entry work on all tasks that are not done.

        Raises
        ------
        BadInput
            As `run` does.
        """
        identity = identity_of(self.asked, self.functions)
        self._read_folder(identity)
        for budget in self.asked.budgets:
            self._play(budget, identity)

    def _read_folder(self, identity: dict[str, str]) -> None:
        """Read what the folder has of the run with an identity.

        Raises
        ------
        BadInput
            If it has submissions of another run, or does not tell of which run they are.
        """
        file, known = self.folder / IDENTITY, self.folder / SUBMISSIONS
        if not known.is_file():
            return
        if not file.is_file():
            hint = f"it contains {SUBMISSIONS} of an unknown exam: name another folder"
            raise BadInput("--out", str(self.folder), hint)
        if _decoded(file, dict[str, str]) != identity:
            hint = "it contains an exam of another entry, source file, site, seed or version: "
            hint += "name another folder"
            raise BadInput("--out", str(self.folder), hint)
        rows = _decoded(known, list[Submission])
        self._done = {(row.name, row.budget): row for row in rows}
        self.resumed = len(self._done)

    def _mark_folder(self, identity: dict[str, str]) -> None:
        """Note to which run the folder belongs."""
        with atomic(self.folder / IDENTITY) as fresh:
            fresh.write_bytes(msgspec.json.encode(identity))

    def _keep(self, submission: Submission) -> None:
        self._done[submission.name, submission.budget] = submission
        with atomic(self.folder / SUBMISSIONS) as fresh:
            fresh.write_bytes(msgspec.json.encode(list(self._done.values())))

    def _play(self, budget: int, identity: dict[str, str]) -> None:
        """Let the entry work on all tasks with a budget that are not done."""
        orders = [o for o in self.asked.orders(budget) if (o.name, budget) not in self._done]
        if not orders:
            return
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        played = []
        with _process(self.functions) as pipe:
            flags = _imported(pipe, self.functions)
            self._mark_folder(identity)
            for order in orders:
                for problem in problems_of(order):
                    self.tick(len(self._done), f"{order.name}: releases without barriers")
                    prepare(problem)
            for order in orders:
                self.tick(len(self._done), f"{order.name}: {budget:,} releases")
                played.append(self._task(pipe, order, flags))
                self._keep(played[-1])
                flags = []
            pipe.send_bytes(b"")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        for one in played:
            self._keep(msgspec.structs.replace(one, seconds=round(seconds / len(played), 3)))

    def _task(self, pipe: Connection, order: TaskOrder, flags: Sequence[str]) -> Submission:
        """Return what the entry submits for a task; `flags` are rules that it broke before."""
        problems = problems_of(order)
        counter = ReleaseCounter(problems, order.budget * len(problems))
        for reason in flags:
            counter.flag(reason)
        option = entrant.option_of(order, self.functions[CORRIDOR_ENTRY])
        with _errors_named(
            option, self.functions[option], f"on {order.name}: return a layout instead"
        ):
            pipe.send_bytes(encode(order))
            while True:
                request = decode_request(pipe.recv_bytes())
                if isinstance(request, ReleaseRequest):
                    pipe.send_bytes(encode(counter.answer(request)))
                elif isinstance(request, FlagRequest):
                    counter.flag(request.reason)
                elif isinstance(request, SubmitRequest):
                    return _submission(order, problems, counter, request)
                else:
                    raise _failure(request, self.functions)

    def seeds(self, name: str, budget: int, chosen: int = 0) -> list[int]:
        """Return the seeds of the verification of a task.

        They follow from all layouts that were submitted with the same budget.

        Parameters
        ----------
        name : str
            Name of the site or corridor.
        budget : int
            Releases per section that the entry was given.
        chosen : int
            Number of the set of releases. The exam uses set 0; others show how far the scores
            depend on the releases.
        """
        fixed = [self._done[order.name, budget].layouts for order in self.asked.orders(budget)]
        text = msgspec.json.encode([self.asked.specification.key, fixed, name, budget, chosen])
        words = np.frombuffer(hashlib.sha256(text).digest(), dtype=np.uint32)
        drawn = np.random.SeedSequence(words.tolist())
        return drawn.generate_state(self.asked.verification, np.uint64).tolist()

    def verify(self, chosen: int = 0) -> list[ExamScore]:
        """Return the scores of the submitted layouts on a set of releases, see `seeds`."""
        orders = [order for budget in self.asked.budgets for order in self.asked.orders(budget)]
        found = []
        for order in orders:
            self.tick(len(self._done), f"{order.name}: verification")
            found.append(self._score(order, chosen))
        return found

    def _score(self, order: TaskOrder, chosen: int) -> ExamScore:
        row = self._done[order.name, order.budget]
        anchor = self.references.anchors[order.name]
        problems, seeds = problems_of(order), self.seeds(order.name, order.budget, chosen)
        layouts = row.built() or ((),) * len(problems)  # an invalid submission builds nothing
        built, best = (
            tuple(
                self._store.evaluate(problem, layout, seeds)
                for problem, layout in zip(problems, own, strict=True)
            )
            for own in (layouts, anchor.built())
        )
        lengths = tuple(order.lengths)
        behind = _total(lengths, built) - _total(lengths, best)
        return ExamScore(
            row, order.money is not None, built, best, lengths,
            1.0 - behind / (anchor.random - anchor.reference),
            behind / (anchor.nothing - anchor.reference),
        )  # fmt: skip


def prepare(problem: DesignProblem) -> None:
    """Compute and store the statistics of a site without barriers, which cost no releases."""
    observe(problem)
    rule.answer(problem)


def _submission(
    order: TaskOrder,
    problems: Sequence[DesignProblem],
    counter: ReleaseCounter,
    request: SubmitRequest,
) -> Submission:
    """Return a checked submission; one that cannot be built is flagged and has no layouts."""
    layouts: list[Tables] = []
    try:
        if request.wrong:
            raise BadInput("layout", request.wrong, "return a layout")
        if len(request.layouts) != len(problems):
            raise BadInput("layouts", len(request.layouts), f"return {len(problems)}")
        cost = 0.0
        for at, problem, own in zip(order.lengths, problems, request.layouts, strict=True):
            cost += at * problem.site.capital(problem.check(from_tables(own)))
        if order.money is not None and cost > order.money * (1.0 + TOLERANCE):
            hint = f"spend at most {order.money:,.0f} EUR"
            raise BadInput("layouts", f"{cost:,.0f} EUR", hint)
        layouts = request.layouts
    except (BadInput, TypeError) as bad:
        counter.flag(f"submitted what cannot be built: {' '.join(str(bad).split())}")
    return Submission(
        order.name, order.budget, layouts, counter.used, counter.refused, counter.flags
    )


def _decoded(file: Path, of: type[Any]) -> Any:
    """Return the content of a JSON file of an exam.

    Raises
    ------
    BadInput
        If the file is damaged.
    """
    try:
        return msgspec.json.decode(file.read_bytes(), type=of)
    except msgspec.MsgspecError as error:
        hint = f"this is damaged: remove the exam in its folder, or name another folder ({error})"
        raise BadInput("exam", str(file), hint) from None


def identity_of(asked: ExamPart, functions: Functions) -> dict[str, str]:
    """Return what distinguishes a run from others, also the source files of the functions.

    The sites count with their contents. The part of the exam does not count, so that a run may
    continue with a larger one.

    Raises
    ------
    BadInput
        If there is no module of a function, or no such site.
    """
    code = [source_hash_of(option, name) for option, name in functions.items() if name]
    whole = asked.specification
    own = [whole.key, whole.content, asked.seed, *functions.values(), *code]
    return {"run": msgspec.json.encode([__version__, *own, MECHANICS]).decode()}


def check_names(functions: Functions) -> None:
    """Check that the modules of functions can be found, without importing them.

    Raises
    ------
    BadInput
        If a name has another form than "package.module:function", or there is no such module.
    """
    for option, name in functions.items():
        if name or option == SITE_ENTRY:
            source_hash_of(option, name)


@contextmanager
def _process(functions: Functions) -> Iterator[Connection]:
    """Start a process of an entry and yield the connection to it."""
    spawn = multiprocessing.get_context("spawn")
    pipe, other = spawn.Pipe()
    names = functions[SITE_ENTRY], functions[CORRIDOR_ENTRY]
    child = spawn.Process(target=entrant.run, args=(other, *names))
    child.start()
    other.close()
    try:
        yield pipe
    except BaseException:
        child.kill()
        raise
    finally:
        child.join()
        pipe.close()


def _imported(pipe: Connection, functions: Functions) -> list[str]:
    """Wait until a process has imported its functions; return the rules that they broke meanwhile.

    Raises
    ------
    BadInput
        If they cannot be imported.
    """
    flags: list[str] = []
    names = ", ".join(filter(None, functions.values()))
    with _errors_named(SITE_ENTRY, names, "while it was imported: correct the module"):
        while not isinstance(request := decode_request(pipe.recv_bytes()), ReadyRequest):
            if not isinstance(request, FlagRequest):
                raise _failure(request, functions)
            flags.append(request.reason)
    return flags


def _failure(request: AnyRequest, functions: Functions) -> BadInput:
    """Return the error that a request reports, or that of a request which is out of turn."""
    if isinstance(request, FailRequest):
        return BadInput(request.option, functions[request.option], request.error)
    hint = f"it sent a {type(request).__name__} out of turn: use the methods of the task"
    return BadInput(SITE_ENTRY, functions[SITE_ENTRY], hint)


@contextmanager
def _errors_named(option: Option, name: str, ended: str) -> Iterator[None]:
    """Turn errors of the connection into errors that name a function.

    `ended` says when its process ended, and the remedy.
    """
    try:
        yield
    except (EOFError, ConnectionError, OSError):
        raise BadInput(option, name, f"its process ended {ended}") from None
    except msgspec.MsgspecError as error:
        hint = f"it sent an unknown request: use the methods of the task ({error})"
        raise BadInput(option, name, hint) from None


def source_hash_of(option: Option, entry: str) -> str:
    """Return a hash of the file of an entry, which is found without importing it.

    Raises
    ------
    BadInput
        If the name has another form than "package.module:function", or there is no such module.
    """
    if not entry.partition(":")[2]:
        raise BadInput(option, entry, "give package.module:function")
    names = entry.partition(":")[0].split(".")
    places: Sequence[str] | None = [os.getcwd(), *sys.path]
    for i, _ in enumerate(names):
        spec = importlib.machinery.PathFinder.find_spec(".".join(names[: i + 1]), places)
        if spec is None:
            hint = "name package.module:function of a module in this folder or an installed one"
            hint += ", without .py" if entry.partition(":")[0].endswith(".py") else ""
            raise BadInput(option, entry, hint)
        places = spec.submodule_search_locations
    file = Path(spec.origin or "") if spec is not None else Path()
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16] if file.is_file() else ""

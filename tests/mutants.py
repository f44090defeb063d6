"""`python -m tests.mutants [PATTERN …]`: break each function in many small ways, and list the changes
that no test notices.

mutmut makes the mutants. A mutant is a function with one small change. `[tool.mutmut]` in
pyproject.toml names the files and the tests. First pytest runs each test once, to see which functions
the test calls. Then each mutant is judged in a forked process, in which the function has the mutant's
code. The tests that call the function run there, the cheapest first, until one test fails.

The results are kept in `build/mutants.json`. A result is used again as long as the function is the
same. If no test has noticed the mutant, the tests must also be the same. PATTERN selects mutants by
name, for example `bridges.kinds.door.*`.
"""

import difflib
import hashlib
import inspect
import os
import re
import resource
import signal
import sys
import time
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from fnmatch import fnmatch
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, Final

import msgspec
import pytest
from mutmut.mutation.file_mutation import compute_function_hashes, mutate_file_contents

TOOL: Final = tomllib.loads(Path("pyproject.toml").read_text())["tool"]["mutmut"]
RESULTS: Final = Path("build/mutants.json")
LEAST_CPU_S: Final = 10.0
"""The CPU time (s) that the tests of a mutant may always use. If ten times their usual time is longer,
they may use that time."""
WALL_S: Final = 3600
"""The longest time (s) by the clock for the tests of a mutant, because a mutant may wait for ever."""
SAVE_EVERY: Final = 50
KILLED, SURVIVED, ENDLESS = "killed", "survived", "endless"
UNTESTED, UNJUDGED = "untested", "not judged"


class Result(msgspec.Struct, frozen=True):
    """The verdict on a mutant, the hash of its function, and the digest of the test files that call
    it."""

    verdict: str
    function: str
    tests: str
    change: str = ""


class Calls(msgspec.Struct, frozen=True):
    """The CPU time (s) of a test, and the functions that the test calls. They are used again as long as
    the test's file and the code have this `digest`."""

    digest: str
    took_s: float
    functions: frozenset[str]


class Known(msgspec.Struct):
    """The content of `build/mutants.json`: a result for each mutant, and calls for each test."""

    results: dict[str, Result] = {}
    calls: dict[str, Calls] = {}


class Mutant(msgspec.Struct, frozen=True):
    """One mutant. `function` is the real function, and `broken` is its changed copy."""

    name: str
    function: FunctionType
    broken: FunctionType
    hash: str
    change: str

    @property
    def of(self) -> str:
        """Return the full name of the real function."""
        return f"{self.function.__module__}.{self.function.__qualname__}"


def mutants_of(path: str) -> Iterator[Mutant]:
    """Yield every mutant of a file. The mutants' code is in a new module object that nobody can
    import."""
    text = Path(path).read_text()
    made = mutate_file_contents(path, text)
    name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    real, copy = import_module(name), ModuleType(name)
    copy.__dict__.update(__file__=path, __package__=real.__package__)
    exec(compile(made.code, path, "exec"), copy.__dict__)
    hashes, lines = compute_function_hashes(text), made.code.splitlines()
    spans = {n: lines[s.start - 1 : s.end] for n, s in made.line_span_by_function_name.items()}
    for mutant in made.mutant_names:
        key = mutant.rpartition("__mutmut_")[0]
        change = _change(spans[f"{key}__mutmut_orig"], spans[mutant])
        yield Mutant(
            f"{name}.{mutant}", _found(real, key), _found(copy, mutant), hashes.get(key, ""), change
        )


def _may_match(path: str, patterns: Sequence[str]) -> bool:
    module = path.removesuffix(".py").replace("/", ".")
    starts = [re.split(r"[*?[]", pattern)[0] for pattern in patterns]
    return any(module.startswith(start) or start.startswith(module) for start in starts)


def _found(module: ModuleType, key: str) -> FunctionType:
    """Return the function for a name that mutmut has made, such as `x_look` or `xǁRobotǁhear`."""
    if key.startswith("xǁ"):
        _, holder, name = key.split("ǁ")
        found = vars(vars(module)[holder])[name if "__mutmut" not in name else key]
    else:
        found = vars(module)[key.removeprefix("x_") if "__mutmut" not in key else key]
    found = inspect.unwrap(getattr(found, "__func__", found))
    assert isinstance(found, FunctionType), key
    return found


def _change(before: Sequence[str], after: Sequence[str]) -> str:
    changed = difflib.ndiff([*map(str.strip, before)], [*map(str.strip, after)])
    return " ".join(line for line in changed if line[0] in "+-" and "__mutmut_" not in line)


class Run:
    """A pytest plugin that runs the tests on the mutants, in place of pytest's own loop over the
    tests."""

    def __init__(self, patterns: Sequence[str], children: int) -> None:
        self._known = msgspec.json.decode(
            RESULTS.read_bytes() if RESULTS.exists() else b"{}", type=Known
        )
        self.results = self._known.results
        files = TOOL["only_mutate"]
        every = [m for path in files if _may_match(path, patterns) for m in mutants_of(path)]
        self.mutants = {m.name: m for m in every if any(fnmatch(m.name, p) for p in patterns)}
        self._files = {str(Path(path).resolve()) for path in files}
        helpers = [
            path for path in Path("tests").rglob("*.py") if not path.name.startswith("test_")
        ]
        self._code = _digest([*map(Path, files), *helpers])
        self._children = children
        self._callers: dict[str, list[pytest.Item]] = defaultdict(list)
        self._running: dict[int, Mutant] = {}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Judge the mutants for which no stored result can be used."""
        for item in session.items:
            for of in self._called(session, item).functions:
                self._callers[of].append(item)
        for items in self._callers.values():
            items.sort(key=lambda item: self._known.calls[item.nodeid].took_s)
        waiting = [m for m in self.mutants.values() if not self._is_known(m)]
        sys.stderr.write(f"{len(self.mutants)} mutants, {len(waiting)} to judge\n")
        for count, mutant in enumerate(waiting, 1):
            self._begin(session, mutant)
            if count % SAVE_EVERY == 0:
                self._save()
                sys.stderr.write(f"{count} of {len(waiting)}\n")
        while self._running:
            self._wait()
        self._save()
        return True

    def _save(self) -> None:
        RESULTS.parent.mkdir(exist_ok=True)
        RESULTS.write_bytes(msgspec.json.format(msgspec.json.encode(self._known), indent=1))

    def _is_known(self, mutant: Mutant) -> bool:
        known = self.results.get(mutant.name)
        if known is None or known.function != mutant.hash:
            return False
        same = known.verdict != UNJUDGED and known.tests == self._tests(mutant)
        return known.verdict == KILLED or same

    def _tests(self, mutant: Mutant) -> str:
        files = {item.path for item in self._callers[mutant.of]}
        return _digest([*files])

    def _called(self, session: pytest.Session, item: pytest.Item) -> Calls:
        """Return the functions that a test calls. Run the test on the real code if no stored answer can
        be used."""
        digest, called = f"{_digest([item.path])} {self._code}", set[str]()
        known = self._known.calls.get(item.nodeid)
        if known is not None and known.digest == digest:
            return known

        def note(frame: Any, event: str, _: object) -> None:
            if event == "call" and frame.f_code.co_filename in self._files:
                called.add(f"{frame.f_globals['__name__']}.{frame.f_code.co_qualname}")

        began = time.process_time()
        sys.setprofile(note)
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        sys.setprofile(None)
        if session.testsfailed:
            sys.stderr.write(f"{item.nodeid} fails without a mutant\n")
            pytest.exit("", returncode=2)
        calls = Calls(digest, time.process_time() - began, frozenset(called))
        self._known.calls[item.nodeid] = calls
        return calls

    def _begin(self, session: pytest.Session, mutant: Mutant) -> None:
        items = self._callers[mutant.of]
        if not items:
            return self._note(mutant, UNTESTED)
        while len(self._running) >= self._children:
            self._wait()
        child = os.fork()
        if child:
            self._running[child] = mutant
            return None
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        usual_s = sum(self._known.calls[item.nodeid].took_s for item in items)
        cpu_s = int(time.process_time() + max(LEAST_CPU_S, 10.0 * usual_s))
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
        signal.alarm(WALL_S)
        code = 3  # the child must end here, and not return to the loop of its parent
        try:
            code = _fails(session, items, mutant)
        finally:
            os._exit(code)

    def _wait(self) -> None:
        child, status = os.wait()
        code = os.waitstatus_to_exitcode(status)
        ends = {0: SURVIVED, 1: KILLED, -signal.SIGXCPU: ENDLESS, -signal.SIGALRM: ENDLESS}
        self._note(self._running.pop(child), ends.get(code, UNJUDGED))

    def _note(self, mutant: Mutant, verdict: str) -> None:
        change = mutant.change if verdict != KILLED else ""
        self.results[mutant.name] = Result(verdict, mutant.hash, self._tests(mutant), change)


def _fails(session: pytest.Session, items: Sequence[pytest.Item], mutant: Mutant) -> int:
    """Run these tests on the mutant. Return 1 as soon as a test fails, or 0.

    This function runs in a process of its own, because it changes the real function.
    """
    real: Any = mutant.function  # Any, because mypy takes the field for a method
    broken: Any = mutant.broken
    try:
        real.__code__ = broken.__code__.replace(co_name=real.__name__)
    except ValueError:  # the mutant uses other closure variables
        return 3
    real.__defaults__, real.__kwdefaults__ = broken.__defaults__, broken.__kwdefaults__
    for item in items:
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        if session.testsfailed:
            return 1
    return 0


def _digest(paths: Sequence[Path]) -> str:
    """Return a short hash of the files' contents."""
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(paths))).hexdigest()[:12]


def main(argv: Sequence[str]) -> int:
    """Judge the mutants. Print a table by file, and the mutants that no test has noticed. Return 1 if
    there are such mutants."""
    run = Run(argv or ["*"], int(os.environ.get("CHILDREN", "1")))
    chosen = TOOL["pytest_add_cli_args_test_selection"]
    options = ["-o", "addopts=-p no:terminal -p no:xdist -p no:faulthandler", *chosen]
    if code := pytest.main(options, plugins=[run]):
        return int(code)
    of_files: dict[str, Counter[str]] = defaultdict(Counter)
    for name in run.mutants:
        of_files[name.rpartition(".")[0]][run.results[name].verdict] += 1
    for file, counts in of_files.items():
        shown = ", ".join(f"{counts[verdict]} {verdict}" for verdict in counts)
        sys.stdout.write(f"{file}: {counts.total()}: {shown}\n")
    left = {name: run.results[name] for name in run.mutants if run.results[name].verdict != KILLED}
    for name, result in left.items():
        sys.stdout.write(f"{result.verdict:10} {name}\n           {result.change}\n")
    return int(any(result.verdict != ENDLESS for result in left.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Old names, for one release: modules give the module they became, keywords the one they became, with a warning."""

import sys
import warnings
from collections.abc import Callable
from functools import wraps
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

_TABLE = """
. weights: checkpoint=prior predictor
nets weights: pair_block=pair adapter weights=container
features kinematics: ik feet
metrics kinematics: physics gestures
. retarget: limbs
io viz: draw figure film overlay scene video
tasks goals: goals=goal goal_file mask_file timeline paths drawing following reach fields lined_file
tasks edits: steering stances fitting duet_places=relative_pose
tasks tasks: redraw=inpaint
tasks lab.papers: double_take humanmac baselines blending=diffusion_blending
nets lab.papers: published=mdm pair_published=commdm mrt guo=guo_nets
train lab.papers: mrt=mrt_training
evaluation lab.papers: guo guo_words
data lab.papers: babel amass threedpw benchmarks pickled
io lab.papers: plain_pickle
features lab.papers: benchmark_layouts
nets lab.evaluator: evaluator=net
train lab.evaluator: evaluator=training pairs
evaluation lab.evaluator: evaluators own agreement
metrics lab.metrics: actions control frechet obedience pair pair_groups prediction prediction_body realism
    retrieval skate transitions
evaluation lab.report: report plots compare results published_rows
evaluation lab.suites: suites=registry clips control control_kinds control_methods duet duet_answers duet_blocks
    duet_long duet_text duet_ways everything generator items long_baselines needs obey parts physical prediction
    prediction_behaviour prediction_studies prediction_trial protocol real_seams realism reference text
    text_reference transitions
. lab: bench evaluation=suites metrics
bench lab.bench: speed long prediction
"""
"""Old folder, new folder: what went from one to the other, OLD=NEW where its own name changed too."""


def _moved() -> dict[str, str]:
    """Old name of each module -> its new one."""
    found = {}
    for line in _TABLE.replace("\n    ", " ").strip().splitlines():
        folders, _, names = line.partition(": ")
        old, new = folders.split()
        for name in names.split():
            before, _, after = name.partition("=")
            found[".".join(["motionloom", *([] if old == "." else [old]), before])] = (
                f"motionloom.{new}.{after or before}"
            )
    return found


class Moved(MetaPathFinder, Loader):
    """Finds modules by the names they had."""

    def __init__(self) -> None:
        self.places = _moved()
        self._spec: dict[str, ModuleSpec | None] = {}

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """A spec for an old name, nothing for any other."""
        return ModuleSpec(fullname, self) if fullname in self.places else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module that an old name became."""
        new = self.places[spec.name]
        say(spec.name, new)
        module = import_module(new)
        self._spec[spec.name] = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Nothing runs again; the import system has given the module the old name's spec, which is taken back."""
        spec = module.__spec__
        if spec is not None and spec.name in self._spec:
            module.__spec__ = self._spec.pop(spec.name)


def install() -> None:
    """Let old names be found, once, before any other finder: folders that moved would make second copies."""
    if not any(isinstance(finder, Moved) for finder in sys.meta_path):
        sys.meta_path.insert(0, Moved())


def renamed(keywords: dict[str, str]) -> Callable[[F], F]:
    """Let a function take old keywords (old name to new name) with a warning that says the new one."""

    def wrap(function: F) -> F:
        @wraps(function)
        def _call(*args: Any, **given: Any) -> Any:
            for old in keywords.keys() & given.keys():
                new = keywords[old]
                if new in given:
                    raise TypeError(f"{function.__name__} got {old!r} and {new!r}, which are one; give {new!r} alone")
                say(f"{old}=", f"{new}=")
                given[new] = given.pop(old)
            return function(*args, **given)

        return _call  # type: ignore[return-value]

    return wrap


def old_names(module: str, names: dict[str, str]) -> Callable[[str], object]:
    """The `__getattr__` of a module that gives what is asked for under an old name (old name to new name)."""

    def _getattr(name: str) -> object:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        say(name, names[name])
        return getattr(sys.modules[module], names[name])

    return _getattr


def say(old: str, new: str, *, above: int = 3) -> None:
    """Warn that an old name is another one now, at the line that many calls up."""
    warnings.warn(f"{old} is {new} now; the old name goes with the next release", FutureWarning, stacklevel=above)

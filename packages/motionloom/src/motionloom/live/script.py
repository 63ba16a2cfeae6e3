"""A scripted session: a YAML file of commands and their times, for films and tests.

    seconds: 12
    seed: 3
    commands:
      - {at: 0, say: a person walks forward}
      - {at: 4, steer: {direction: 90, speed: 1.4}}
      - {at: 8, path: {points: [[2, 3], [4, 0]]}}

Times are seconds; what the commands hold is what their JSON objects hold (`commands.from_json`). With ``people: 2`` a
command may name its ``person``, 1 or 2; without that it is for both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from motionloom.core.errors import MotionloomError
from motionloom.goals.fields import LinedFile
from motionloom.goals.roles import prompts_of
from motionloom.io.lined_yaml import Lined, read_lined
from motionloom.live.commands import Command, Say, from_json, person_of
from motionloom.live.live import Frame, Stage
from motionloom.requests.fields import specs
from motionloom.requests.live import ScriptKeys, TimedKeys

MOST = 10_000
"""Commands of a script."""
MAX_BYTES = 4_000_000
_TYPES = ("say", "steer", "path", "reach", "pose")


class Timed(NamedTuple):
    """A command at a time."""

    at: float
    """Seconds."""
    command: Command
    person: int | None = None
    """0 or 1; None: everybody."""


@dataclass(frozen=True)
class Script:
    """Commands and their times."""

    seconds: float
    commands: tuple[Timed, ...]
    """Times rising."""
    seed: int = 0
    people: int = 1
    """1 or 2."""

    def run(self, live: Stage) -> Iterator[tuple[Frame, ...]]:
        """The frames of everybody, each command sent before the frames of its time."""
        waiting = list(self.commands)[::-1]
        for number in range(max(1, round(self.seconds * live.fps))):
            while waiting and waiting[-1].at * live.fps <= number + 1e-6:
                _, command, person = waiting.pop()
                live.ask(command, person)
            yield live.frames()


def read_script(path: Path | str) -> Script:
    """A script file; `MotionloomError` names file and line of what is wrong with it."""
    path = Path(path)
    return _Reader(path).script(read_lined(path, max_bytes=MAX_BYTES))


@dataclass(frozen=True)
class _Reader(LinedFile):
    def script(self, root: Lined) -> Script:
        keys = specs(ScriptKeys)
        parts = self.mapping(root, tuple(keys), "a live script")
        seconds, seed, people = (self.field(parts, keys, name) for name in ("seconds", "seed", "people"))
        if seconds is None:
            self.fail(root.line, "a live script says how long it is: give 'seconds'")
        listed = parts.get("commands")
        entries: Sequence[Lined] = []
        if listed is not None and listed.value != []:
            entries = self.items(listed, "commands", of="command", most=MOST)
        commands = sorted((self._command(entry, people or 1) for entry in entries), key=lambda one: one.at)
        return Script(seconds, tuple(commands), seed or 0, people or 1)

    def _command(self, entry: Lined, people: int) -> Timed:
        keys = dict(specs(TimedKeys))
        keys["person"] = replace(keys["person"], high=people)
        parts = self.mapping(entry, (*keys, *_TYPES), "a command")
        at = self.field(parts, keys, "at")
        kinds = [kind for kind in _TYPES if kind in parts]
        if at is None or len(kinds) != 1:
            self.fail(entry.line, f"a command has a time 'at' and one of {', '.join(_TYPES)}")
        value = parts[kinds[0]]
        data = value.plain()
        fields = {"text": data} if kinds[0] == "say" else {} if data is None else data
        if not isinstance(fields, dict):
            self.fail(value.line, f"'{kinds[0]}' must be a mapping; got {self.kind(value)}")
        whom = person_of({"person": self.field(parts, keys, "person")})
        try:
            command = from_json({**fields, "type": kinds[0]})
            if isinstance(command, Say) and people > 1 and whom is None:
                prompts_of(command.text)
            return Timed(at, command, whom)
        except MotionloomError as error:
            self.fail(value.line, str(error))

"""Scripts of live sessions: what they say is what is asked, and mistakes are told with file and line."""

import json
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.live.commands import Path as Way
from motionloom.live.commands import Reach, Say, Steer, to_json
from motionloom.live.live import Live
from motionloom.live.script import Script, Timed, read_script
from tests.live import people
from tests.live.people import QUICK
from tests.live.test_socket import COMMANDS

TIMES = st.integers(0, 200).map(lambda n: n / 20)
EXAMPLE = Path(__file__).parents[4] / "examples" / "live" / "session.yaml"
TEXT = """seconds: 3
seed: 4
commands:
- {at: 1.5, steer: {direction: 90, speed: 1.4}}
- {at: 0, say: a person walks}
- at: 2
  reach: {joint: left_wrist, position: [0, 1, 0.5]}
- {at: 2.5, steer: }
"""


def numbers(steer: Steer) -> list[float]:
    return [value for value in (steer.direction, steer.speed, steer.facing) if value is not None]


def read(folder: Path, text: str) -> Script:
    (folder / "a.yaml").write_text(text)
    return read_script(folder / "a.yaml")


def test_a_script_says_what_is_asked_when(tmp_path: Path) -> None:
    script = read(tmp_path, TEXT)
    assert (script.seconds, script.seed) == (3.0, 4)
    times, commands, _ = zip(*script.commands, strict=True)
    assert times == (0.0, 1.5, 2.0, 2.5)
    assert commands[0] == Say("a person walks")
    assert numbers(commands[1]) == pytest.approx([1.5707963, 1.4])
    assert commands[2:] == (Reach("left_wrist", (0.0, 1.0, 0.5)), Steer())


def test_the_example_is_one() -> None:
    assert any(isinstance(one.command, Way) for one in read_script(EXAMPLE).commands)


def test_commands_are_asked_before_the_frame_of_their_time() -> None:
    commands: list[tuple[int, object]] = []

    class Watched(Live):
        def ask(self, command, person=None) -> None:
            commands.append((self.number, command))
            super().ask(command, person)

    script = Script(0.8, (Timed(0.0, Say("a person walks")), Timed(0.49, Steer(1.0)), Timed(0.5, Steer())))
    frames = list(script.run(Watched(people.prior(), settings=QUICK)))
    assert len(frames) == 16
    assert [number for number, _ in commands] == [0, 10, 10]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("commands: []", "line 1: a live script says how long"),
        ("seconds: -1", "line 1: 'seconds' must be"),
        ("seconds: 2\nseed: 1.5", "line 2: 'seed'"),
        ("seconds: 2\ncommands: 7", "line 2: 'commands' must be a list"),
        ("seconds: 2\ncommands:\n- {say: walk}", "line 3: a command has a time"),
        ("seconds: 2\ncommands:\n- {at: 1, say: walk, path: {}}", "line 3: a command has a time"),
        ("seconds: 2\npeople: 3", "line 2: 'people' must be"),
        ("seconds: 2\ncommands:\n- {at: 1, person: 2, say: walk}", "line 3: 'person' must be"),
        ("people: 2\nseconds: 2\ncommands:\n- {at: 1, say: 'a :: b :: c'}", "line 4: the prompt 'a :: b :: c'"),
        ("seconds: 2\ncommands:\n- {at: 1, fly: up}", "line 3: unknown key 'fly'"),
        ("seconds: 2\ncommands:\n- {at: 1, steer: 3}", "line 3: 'steer' must be a mapping"),
        ("seconds: 2\ncommands:\n- {at: 1, steer: {speed: 99}}", "line 3: 'speed' must be 0 to 12 m/s; got 99"),
        ("seconds: 2\ncommands:\n- {at: 1, path: {points: []}}", "line 3: points must be a list"),
        ("seconds: 2\ncommands:\n- {at: 1, say: {a: 1}}", "line 3: 'text' must be text"),
        ("seconds: 2\ncommands:\n- {at: 1, reach: {joint: tail, position: [0, 1, 0]}}", "line 3: no joint 'tail'"),
    ],
)
def test_mistakes_are_reported_with_file_and_line(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(MotionloomError, match=r"a\.yaml, ") as raised:
        read(tmp_path, text)
    assert sentence in str(raised.value)


SURROGATES = re.compile(r"\\u(d[89ab]..)\\u(d[c-f]..)")
"""A letter beyond the first 65,536 as JSON writes it; YAML has another way."""


def whole_letter(pair: re.Match[str]) -> str:
    high, low = (int(part, 16) for part in pair.groups())
    return f"\\U{0x10000 + ((high - 0xD800) << 10) + (low - 0xDC00):08x}"


def to_yaml(script: Script) -> str:
    """The text of a script file."""
    lines = [f"seconds: {script.seconds:g}", f"seed: {script.seed}", f"people: {script.people}"]
    lines += ["commands:" if script.commands else "commands: []"]
    for at, command, person in script.commands:
        whom = {} if person is None else {"person": person + 1}
        fields = to_json(command)
        kind = fields.pop("type")
        value = fields["text"] if kind == "say" else fields
        lines.append(f"  - {SURROGATES.sub(whole_letter, json.dumps({'at': round(at, 6), **whom, kind: value}))}")
    return "\n".join(lines) + "\n"


@settings(max_examples=15)
@given(st.lists(st.tuples(TIMES, COMMANDS, st.sampled_from([None, 0, 1])), max_size=6), st.sampled_from([1, 2]))
def test_what_is_written_is_read_again(tmp_path_factory: pytest.TempPathFactory, commands, people: int) -> None:
    timed = [Timed(at, command, 0 if isinstance(command, Say) else whom) for at, command, whom in commands]
    timed = timed if people > 1 else [one._replace(person=None) for one in timed]
    script = Script(10.0, tuple(sorted(timed, key=lambda one: one.at)), 5, people)
    again = read(tmp_path_factory.mktemp("script"), to_yaml(script))
    assert again.people == people
    assert [(one.at, one.person) for one in again.commands] == [(one.at, one.person) for one in script.commands]
    for (_, old, _), (_, new, _) in zip(script.commands, again.commands, strict=True):
        if isinstance(old, Steer):
            assert numbers(new) == pytest.approx(numbers(old), abs=1e-6)
        else:
            assert new == old

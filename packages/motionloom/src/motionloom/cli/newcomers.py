"""What people type who have not read the help: other names of commands and options, sentences without quotes."""

import argparse
from collections.abc import Iterable, Sequence

from motionloom.cli.terminal import note
from motionloom.core.errors import MotionloomError

COMMANDS = {"gen": "generate", "convert": "export", "play": "view", "show": "view", "draw": "view", "join": "compose"}
OPTIONS = {"--length": "--seconds", "--duration": "--seconds", "-o": "--out", "--output": "--out", "-n": "--count"}
RENAMED = {
    "--raw": "--no-foot-lock",
    "--loose": "--no-fit",
    "--given": "--react-to",
    "--block": "--pair-weights",
    "--together": "--pair-guidance",
}
"""Options under the names they had, for one release."""
_SEVERAL = {"-s": ("--seconds", "--seed"), "-f": ("--fps", "--from")}
_PROMPTS = ("prompts", "prompt", "text", "segments")


def with_command(words: Sequence[str], commands: Iterable[str]) -> list[str]:
    """The line with its command under the name it has here; words without one become a suggestion.

    Raises `MotionloomError` where the first word is no command.
    """
    known, words = list(commands), list(words)
    if not words or words[0].startswith("-") or words[0] in known:
        return words
    if words[0] in COMMANDS:
        return [COMMANDS[words[0]], *words[1:]]
    close = _close(words[0].lower(), [*known, *COMMANDS], 0.7)
    if close and " " not in words[0]:
        line = " ".join([COMMANDS.get(close[0], close[0]), *words[1:]])
        raise MotionloomError(f"there is no command {words[0]!r}; did you mean: motionloom {line}")
    sentence = " ".join(word for word in words if not word.startswith("-"))
    if " " in sentence:
        raise MotionloomError(f'a command comes first; did you mean: motionloom generate "{sentence}"')
    raise MotionloomError(f"there is no command {words[0]!r}; the commands are {', '.join(known)}")


def _close(word: str, known: Sequence[str], cutoff: float) -> list[str]:
    import difflib  # here, since whoever makes no mistake need not wait for it

    return difflib.get_close_matches(word, known, n=1, cutoff=cutoff)


def with_options(parser: argparse.ArgumentParser, words: Sequence[str]) -> list[str]:
    """The words behind a command with its options under the names they have here."""
    known = option_names(parser)
    takes_prompt = any(action.dest in _PROMPTS for action in parser._actions)
    options, plain = [], False
    for word in words:
        name, equals, value = word.partition("=")
        plain = plain or word == "--"
        if plain or name in known:
            options.append(word)
        elif RENAMED.get(name) in known:
            note(f"{name} is {RENAMED[name]} now; the old name goes with the next release")
            options.append(RENAMED[name] + equals + value)
        elif OPTIONS.get(name) in known:
            options.append(OPTIONS[name] + equals + value)
        elif name == "--prompt" and takes_prompt:
            options += [value] if equals else []  # the sentence itself is the next word
        else:
            options.append(word)
    return options


def option_names(parser: argparse.ArgumentParser) -> set[str]:
    """All options of a command, as they are typed."""
    return {name for action in parser._actions for name in action.option_strings}


def suggestion(parser: argparse.ArgumentParser, words: Sequence[str]) -> str:
    """``, did you mean ...`` for the first option that a command does not have, or nothing."""
    known = option_names(parser)
    names = {name: name for name in known} | {alias: name for alias, name in OPTIONS.items() if name in known}
    for word in words:
        name = word.partition("=")[0]
        if name in _SEVERAL and set(_SEVERAL[name]) & known:
            return f", did you mean {' or '.join(n for n in _SEVERAL[name] if n in known)}?"
        if name.startswith("-") and (close := _close(name, sorted(names), 0.6)):
            return f", did you mean {names[close[0]]}?"
    return ""


def one_sentence(words: Sequence[str]) -> list[str]:
    """Prompts; words without quotes are one sentence."""
    if len(words) < 2 or any(" " in word.strip() for word in words):
        return list(words)
    return [" ".join(words)]


def take_text_anywhere(parser: argparse.ArgumentParser) -> None:
    """Let TEXT stand behind options too: argparse gives up on an optional word once it has passed its place."""

    def parse(args=None, namespace=None):
        line = None if args is None else with_options(parser, args)
        arguments, unknown = argparse.ArgumentParser.parse_known_args(parser, line, namespace)
        words = [*([] if arguments.text is None else [arguments.text]), *unknown]
        if not any(word.startswith("-") for word in unknown) and len(one_sentence(words)) == 1:
            arguments.text, unknown = one_sentence(words)[0], []
        if unknown:
            parser.error(f"unrecognized arguments: {' '.join(unknown)}{suggestion(parser, unknown)}")
        return arguments, unknown

    parser.parse_known_args = parse  # type: ignore[method-assign]

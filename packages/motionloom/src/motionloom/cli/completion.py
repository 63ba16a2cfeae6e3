"""`motionloom completion`: what a shell needs to complete commands, options and file names."""

import argparse
from argparse import Namespace

_BASH = """_motionloom() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} command=${{COMP_WORDS[1]}} words=""
    if [ "$COMP_CWORD" -eq 1 ]; then words="{commands}"; else
        case $command in
{cases}
        esac
    fi
    case $word in
        -*) COMPREPLY=($(compgen -W "$words" -- "$word")) ;;
        *) if [ "$COMP_CWORD" -eq 1 ]; then COMPREPLY=($(compgen -W "$words" -- "$word"))
           else COMPREPLY=($(compgen -f -- "$word")); fi ;;
    esac
}}
complete -o filenames -F _motionloom motionloom
"""


def run_completion(arguments: Namespace) -> None:
    """``motionloom completion SHELL``."""
    from motionloom.cli import commands_of, parser

    print(script(arguments.shell, commands_of(parser())), end="")


def script(shell: str, commands: "dict[str, argparse.ArgumentParser]") -> str:
    """The script for one shell; ``commands`` are the parsers by name."""
    options = {
        name: sorted(o for action in parser._actions for o in action.option_strings if o.startswith("--"))
        for name, parser in commands.items()
    }
    if shell == "fish":
        lines = [f"complete -c motionloom -n __fish_use_subcommand -f -a '{' '.join(commands)}'"]
        for name, words in options.items():
            test = f"'__fish_seen_subcommand_from {name}'"
            lines += [f"complete -c motionloom -n {test} -l {option[2:]}" for option in words]
        return "\n".join(lines) + "\n"
    cases = "\n".join(f'            {name}) words="{" ".join(words)}" ;;' for name, words in options.items())
    bash = _BASH.format(commands=" ".join(commands), cases=cases)
    return "autoload -U +X bashcompinit && bashcompinit\n" + bash if shell == "zsh" else bash

"""How often a prompt is called unknown: prompts of actions that are in the data, and of actions that are not.

    python benchmarks/unknown.py [SET] [--weights default]

SET is a built set whose held-out captions are asked too. The table is that of docs/words.md. Phrases of `unknown.toml`
whose list is called "judge" were not looked at when the rule was chosen.
"""

import argparse
import tomllib
from collections.abc import Sequence
from pathlib import Path

from motionloom.core.models.prior import Prior
from motionloom.goals.remarks import nearest_known
from motionloom.goals.sequence import split_actions
from motionloom_lab.metrics.obedience import EVERYDAY, in_words
from motionloom_train.data.sets import read_clips

HERE = Path(__file__).parent


def parts(prompts: Sequence[str]) -> list[str]:
    """The prompts as they are drawn and looked up: one action after the other."""
    return [part.text for prompt in prompts for part in split_actions(prompt)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("set", nargs="?")
    parser.add_argument("--weights", default="default")
    arguments = parser.parse_args()
    prior = Prior.load(arguments.weights)
    if prior.known is None:
        raise SystemExit(f"{arguments.weights} has no table of what it knows")
    phrases = tomllib.loads((HERE / "unknown.toml").read_text(encoding="utf-8"))
    held = [
        text
        for clip in (read_clips(arguments.set, splits=("val", "test")) if arguments.set else ())
        for note in clip.notes
        if note.kind == "human"
        for text in note.texts
    ]
    asked = {
        "captions of clips held out": list(dict.fromkeys(held)),
        "everyday prompts": parts([check.prompt for check in EVERYDAY]),
        "the same in other words": parts([check.paraphrases[0] for check in EVERYDAY]),
        "the same in words nobody looked at": parts(
            [check.prompt for check in in_words(EVERYDAY, HERE / "everyday_unseen.toml")]
        ),
    } | {f"{kind}, to {use}": listed for kind, uses in phrases.items() for use, listed in uses.items()}
    print("| sentences | called unknown |\n|---|---|")
    for name, prompts in asked.items():
        found = nearest_known(prompts, prior.known, prior.text) if prompts else []
        if found:
            print(f"| {len(prompts)} {name} | {sum(not one.near for one in found) / len(found):.1%} |", flush=True)


if __name__ == "__main__":
    main()

"""`motionloom evaluate checks`: the everyday checks tried on real people who do what is asked, and on real people
who don't."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import say


def add(subparsers) -> None:
    """Register the command."""
    parser = subparsers.add_parser(
        "checks", help="try the everyday checks on real clips: who passes, who slips through"
    )
    parser.add_argument(
        "--data", type=Path, action="append", required=True, help="built set or recordings (repeatable)"
    )
    parser.add_argument("--only", action="append", metavar="CHECK", help="only this check, such as 'bow' (repeatable)")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="folder for checks.json and checks.md")
    parser.add_argument("--misses", action="store_true", help="list the clips that were judged wrongly, and why")
    parser.set_defaults(run=_checks)


def _checks(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.lab.metrics.obedience import chosen
    from motionloom.lab.report import files
    from motionloom.lab.suites import trial
    from motionloom.lab.suites.clips import real_clips
    from motionloom.lab.suites.trial_clips import trials

    checks = [check for check in chosen("everyday", arguments.only) if check.theme]
    if not checks:
        raise MotionloomError("only everyday checks are tried here; 'motionloom evaluate reference' tries the others")
    if arguments.out:
        files.check_report(arguments.out / "checks.json")
    clips = [clip for folder in arguments.data for clip in real_clips(folder)]
    say(f"{len(clips)} real clips")
    found = trial.tried(checks, trials(), clips, progress=say)
    rows = trial.table(found)
    sound = sum(not tally.doubts() for tally in found.values())
    said = (
        f"{sound} of {len(found)} checks are sound on {len(clips)} real clips: at least {trial.CAUGHT:.0%} of the "
        f"examples pass, at most {trial.WRONG:.0%} of other actions, none of the other side, and neither standing nor "
        "walking"
    )
    if arguments.out:
        files.write_json(arguments.out / "checks.json", {"clips": len(clips), "checks": trial.summary(found)})
        page = f"# Everyday checks on real clips\n\n{said}.\n\n{files.markdown(rows)}\n"
        files.write_text(arguments.out / "checks.md", page)
    print(f"{files.plain(rows)}\n\n{said}")
    if arguments.misses:
        for name, tally in found.items():
            print(f"\n{name}", *(f"  missed  {line}" for line in tally.missed), sep="\n")
            print(*(f"  slipped {line}" for line in tally.slipped), sep="\n")

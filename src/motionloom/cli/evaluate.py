"""`motionloom evaluate`: does it do what the words say, does it look real, and did it get better."""

import argparse
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from motionloom.cli.measuring import say
from motionloom.cli.writing import add_force, check_overwriting

PARTS = (
    "evaluate_checks",
    "evaluate_text",
    "evaluate_transitions",
    "evaluate_control",
    "evaluate_prediction",
    "evaluate_duet",
    "evaluate_evaluator",
    "evaluate_all",
)
"""Modules beside this one that register further commands."""


def add(subparsers) -> None:
    """Register the commands of `evaluate`, those of `PARTS` included."""
    family = subparsers.add_parser("evaluate", help="measure weights: obedience, realism, text metrics; compare runs")
    commands = family.add_subparsers(metavar="COMMAND", required=True)
    _physical(commands)
    for part in PARTS:
        import_module(f"motionloom.cli.{part}").add(commands)
    for name, parser in commands.choices.items():
        if name != "compare":
            add_force(parser)
            parser.set_defaults(run=_saying_what_is_there(parser.get_default("run")))


def _saying_what_is_there(
    run: Callable[[argparse.Namespace], int | None],
) -> Callable[[argparse.Namespace], int | None]:
    """The command, after a note about finished pages that it writes over; what a stopped run left has none."""

    def run_with_note(arguments: argparse.Namespace) -> int | None:
        out = getattr(arguments, "out", None)
        if out is not None:
            pages = [out] if out.is_file() else sorted({*out.glob("*.md"), *out.glob("*/report.md")})
            check_overwriting(arguments, pages)
        return run(arguments)

    return run_with_note


def _physical(commands) -> None:
    obedience = commands.add_parser("obedience", help="everyday prompts, each with a physical check, on several seeds")
    _sampling(obedience, seeds="default 0 for the basic set, 100 for the others")
    obedience.add_argument(
        "--set",
        default="basic",
        metavar="basic|everyday|all",
        dest="prompts",
        help="the twenty prompts of old, those of everyday life, or both (default basic)",
    )
    obedience.add_argument("--seeds", type=int, default=10, help="seeds per prompt (default 10)")
    obedience.add_argument(
        "--best-of", type=int, default=1, metavar="N", help="as of generate, where a prompt is one action"
    )
    obedience.add_argument("--paraphrases", action="store_true", help="also try the same prompts in other words")
    obedience.add_argument(
        "--only", action="append", metavar="CHECK", help="only this check, such as 'walk forward' (repeatable)"
    )
    obedience.add_argument(
        "--words", type=Path, metavar="FILE.toml", help="your own sentence for each check, by its name, as the prompt"
    )
    obedience.add_argument("--sheet", type=Path, metavar="FILE.png", help="also draw the first draw of every prompt")
    obedience.set_defaults(run=_obedience, seed=None)

    realism = commands.add_parser("realism", help="foot skate, penetration, jerk, bones and speed against real clips")
    _sampling(realism)
    realism.add_argument(
        "--data", type=Path, help="built set or recordings with held-out clips (default: shipped numbers)"
    )
    realism.add_argument("--count", type=int, default=64, help="motions to compare (default 64)")
    realism.add_argument(
        "--recordings",
        type=Path,
        action="append",
        metavar="FOLDER",
        help="recordings whose own skeletons bodies are compared with (repeatable; default: shipped percentiles)",
    )
    realism.set_defaults(run=_realism)

    reach = commands.add_parser(
        "reach", help="how recorded people hold their bodies: percentiles for 'evaluate realism'"
    )
    reach.add_argument(
        "--recordings", type=Path, action="append", required=True, metavar="FOLDER", help="recordings (repeatable)"
    )
    reach.add_argument("--out", type=Path, help="write the percentiles to this JSON file")
    reach.set_defaults(run=_reach)

    reference = commands.add_parser("reference", help="judge real clips: pass rates, false alarms, realism numbers")
    reference.add_argument("--data", type=Path, required=True, help="built set or recordings")
    reference.add_argument("--out", type=Path, help="write the numbers to this JSON file")
    reference.set_defaults(run=_reference)


def _sampling(parser: argparse.ArgumentParser, *, seeds: str = "default 0") -> None:
    parser.add_argument("--weights", default="default", help="shipped name or file (default: default)")
    parser.add_argument("--seed", type=int, default=0, help=f"first seed ({seeds})")
    parser.add_argument("--steps", type=int, help="sampler steps (default: as generate)")
    parser.add_argument("--guidance", type=float, help="strength of the text (default: as generate)")
    parser.add_argument("--solver", help="solver name (default: as generate)")
    parser.add_argument(
        "--finished", action="store_true", help="measure what is exported: bones constant, feet cleaned up"
    )
    parser.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    parser.add_argument(
        "--out", type=Path, help="folder for the JSON results and report.md; a run that stopped goes on"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


def _generator(arguments: argparse.Namespace):
    """The prior behind a plain function of prompts, length and seed."""
    from motionloom.lab.suites.generator import generator
    from motionloom.weights.prior import Prior

    prior = Prior.load(arguments.weights, device=arguments.device)
    return generator(
        prior,
        steps=arguments.steps,
        guidance=arguments.guidance,
        solver=arguments.solver,
        finished=arguments.finished,
        best_of=getattr(arguments, "best_of", 1),
    )


def _run(arguments: argparse.Namespace):
    """Where and how it is measured, for the suites."""
    from motionloom.lab.suites.harness import Run

    return Run(arguments.weights, folder=arguments.out, device=arguments.device, progress=say)


def _weights_line(arguments: argparse.Namespace) -> str:
    """Name and hash of the weights that were measured: pages which show the table are held against them."""
    from motionloom.lab.suites.harness import weight_marks
    from motionloom.weights.prior import find_weights

    [(name, mark)] = weight_marks([find_weights(arguments.weights)]).items()
    return f"Weights: {name} {mark}"


def _settings(arguments: argparse.Namespace) -> dict:
    return {name: getattr(arguments, name) for name in ("weights", "steps", "guidance", "solver", "finished")}


def _obedience(arguments: argparse.Namespace) -> None:
    import json

    from motionloom.lab.metrics.obedience import chosen, in_words
    from motionloom.lab.report import files
    from motionloom.lab.suites import everyday, obey
    from motionloom.lab.suites.reference import known
    from motionloom.viz.film import suffixed

    checks = chosen(arguments.prompts, arguments.only)
    if arguments.words:
        checks = in_words(checks, arguments.words)
    if arguments.sheet:
        files.check_report(suffixed(arguments.sheet, (".png",)))
    seed = _first_seed(arguments)
    settings = _settings(arguments) | ({"best_of": arguments.best_of} if arguments.best_of > 1 else {})
    generate = everyday.FirstDraws(_generator(arguments))
    results = obey.run(
        _run(arguments),
        checks,
        generate=generate,
        seeds=arguments.seeds,
        first_seed=seed,
        paraphrases=arguments.paraphrases,
        settings=settings,
    )
    rows = obey.table(results, checks, real=known()["checks"] if arguments.prompts != "everyday" else None)
    themes = everyday.themes(results)
    found = obey.totals(results, checks)
    said = (
        f"{found['prompts_obeyed']} of {found['prompts']} prompts obeyed on at least {obey.ENOUGH:.0%} of the seeds, "
        f"{found['prompts_mostly_obeyed']} on at least {obey.MOSTLY:.0%}; "
        f"{found['seeds_obeyed_share']:.1%} of all seeds"
    )
    if "paraphrases_obeyed_share" in found:
        said += (
            f";\nin other words {found['paraphrases_obeyed']} of {found['paraphrases']}, "
            f"{found['paraphrases_mostly_obeyed']} and {found['paraphrases_obeyed_share']:.1%}"
        )
    if arguments.out:
        parts = [files.markdown(themes)] if len(themes) > 1 else []
        parts += [files.markdown(rows), _weights_line(arguments)]
        text = "\n\n".join([f"# Obedience of {arguments.weights}", f"{said}.", *parts])
        files.write_text(arguments.out / "report.md", text + "\n")
    if arguments.sheet:
        generate.draw(checks, arguments.sheet, seed=seed)
    if arguments.json:
        print(json.dumps(obey.summary(results, checks, settings=settings), indent=1))
    else:
        tables = [files.plain(rows), *([files.plain(themes)] if len(themes) > 1 else [])]
        print("\n\n".join([*tables, said]))


def _first_seed(arguments: argparse.Namespace) -> int:
    """What was said; else 0 for the twenty of old, and 100 where seeds should be ones that nothing was chosen by."""
    if arguments.seed is not None:
        return arguments.seed
    return 0 if arguments.prompts == "basic" else 100


def _realism(arguments: argparse.Namespace) -> None:
    import json

    from motionloom.errors import MotionloomError
    from motionloom.lab.report import files
    from motionloom.lab.suites import bodies, realism
    from motionloom.lab.suites.clips import real_clips
    from motionloom.lab.suites.reference import known

    if not 1 <= arguments.count <= 100_000:
        raise MotionloomError(f"the count must be from 1 to 100000; got {arguments.count}")
    if arguments.out:
        files.check_report(arguments.out / "realism.json")
    if arguments.data:
        chosen = realism.choose(list(real_clips(arguments.data)), arguments.count)
        if not chosen:
            raise MotionloomError(f"{arguments.data} has no held-out captioned clips of 2 to 10 s; leave --data out")
        wanted, real = realism.orders(chosen), [clip.positions for clip in chosen]
    else:
        wanted, real = realism.everyday(arguments.count), known()["realism"]["held_out"]
    reach = bodies.reach_of(arguments.recordings, say=say) if arguments.recordings else bodies.known()
    made, fps = realism.run(_run(arguments), wanted, generate=_generator(arguments), seed=arguments.seed)
    body = bodies.judge(made, reach)
    found = {"settings": _settings(arguments), **realism.judge(made, fps, real), "body": body}
    rows, held = realism.table(found), bodies.table(body)
    said = (
        f"{found['passed']} of {len(rows) - 1} numbers within 1.5 times of real (or too small to see), and "
        f"{body['passed']} of {body['of']} of the body within what recorded people do"
    )
    if not arguments.data:
        said += "; the real numbers are of other actions: name recordings with --data to compare like with like"
    if arguments.out:
        files.write_json(arguments.out / "realism.json", found)
        parts = [f"# Realism of {arguments.weights}", f"{said}.", files.markdown(rows), files.markdown(held)]
        files.write_text(arguments.out / "realism.md", "\n\n".join([*parts, _weights_line(arguments)]) + "\n")
    print(json.dumps(found, indent=1) if arguments.json else f"{files.plain(rows)}\n\n{files.plain(held)}\n\n{said}")


def _reach(arguments: argparse.Namespace) -> None:
    import json

    from motionloom.lab.metrics.bodies import LEVELS
    from motionloom.lab.report import files
    from motionloom.lab.suites import bodies

    if arguments.out:
        files.check_report(arguments.out)
    found = {"percentiles": list(LEVELS), "reach": bodies.reach_of(arguments.recordings, say=say)}
    if arguments.out:
        files.write_json(arguments.out, found)
    print(json.dumps(found, indent=1))


def _reference(arguments: argparse.Namespace) -> None:
    from motionloom.lab.report import files
    from motionloom.lab.suites import reference
    from motionloom.lab.suites.clips import real_clips

    if arguments.out:
        files.check_report(arguments.out)
    found = reference.reference(real_clips(arguments.data), progress=say)
    if arguments.out:
        files.write_json(arguments.out, found)
    print(files.plain(reference.rates(found)))
    print("\nper cent of real clips of an action (rows) that pass each check (columns)\n")
    print(files.plain(reference.confusion_table(found)))

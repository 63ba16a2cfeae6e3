"""What the commands of `motionloom evaluate` do: a function each, of the options that were given (``options.toml``)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior, find_weights
from motionloom_lab.report import files
from motionloom_lab.report import report as reports
from motionloom_lab.report.report import Report
from motionloom_lab.suites import options, registry
from motionloom_lab.suites.harness import Generate, Run, check_names, say, weight_marks

Asked = Mapping[str, Any]
PROMPT = "a person walks forward and waves"
"""What the memory is measured with."""


def tools_of(asked: Asked) -> registry.Tools:
    """Motions and speeds of the weights, which are loaded once, when a suite first asks."""
    from motionloom_lab.bench import Sampling, bench
    from motionloom_lab.suites.harness import generator

    @cache
    def prior() -> Prior:
        return Prior.load(asked["weights"], device=asked.get("device", "cpu"))

    return registry.Tools(
        generator=lambda finished: generator(prior(), finished=finished),
        prior=prior,
        memory=lambda steps: memory_of(asked, steps),
        speed=lambda quick: bench(prior(), Sampling(), what="all", quick=quick, weights=asked["weights"], progress=say),
        progress=say,
    )


def memory_of(asked: Asked, steps: int) -> float:
    """Peak MB of a fresh process that generates eight motions of 9.8 s, as files."""
    import tempfile

    from motionloom_lab.bench import process

    with tempfile.TemporaryDirectory() as folder:
        how = {"weights": asked["weights"], "steps": steps, "seconds": 9.8, "count": 8, "device": asked["device"]}
        words = [word for name, value in how.items() for word in (f"--{name}", str(value))]
        return process(["generate", PROMPT, *words, "--out", str(Path(folder) / "motion.npz")]).peak_mb


def job_of(asked: Asked, command: str = "", folder: Path | None = None) -> registry.Job:
    """What a suite measures, as options say; a ``folder`` that cannot be written to is refused now."""
    if folder:
        files.check_report(folder / "report.json")
    if asked.get("threads") is not None:
        from motionloom_train.tensors import set_threads

        if not 1 <= asked["threads"] <= 1024:
            raise MotionloomError(f"the number of threads must be from 1 to 1024; got {asked['threads']}")
        set_threads(asked["threads"])
    return registry.Job(
        str(asked["weights"]),
        tools_of(asked),
        asked.get("data"),
        asked.get("evaluator", "own"),
        bool(asked.get("quick")),
        asked.get("device", "cpu"),
        folder,
        command,
    )


def measured(asked: Asked) -> None:
    """One suite; its report goes into ``--out`` and is printed."""
    if asked.get("make_reference"):
        return make_reference(asked)
    name = asked["command"]
    job = job_of(asked, options.typed(options.commands()[name], asked), asked.get("out"))
    (suite,) = registry.chosen([name])
    found = suite.run(job, asked)
    show(found, asked.get("out"), asked, published=name == "prediction")
    if asked.get("json"):
        print(json.dumps(reports.encode(found), indent=1))
    return None


def show(found: Report, folder: Path | None, asked: Asked, *, published: bool) -> None:
    """Write a report, and print it; without ``published`` wide rows of other data go to files alone."""
    if folder:
        reports.write(found, folder)
    if not asked.get("json"):
        here = replace(found, rows=tuple(row for row in found.rows if not row.measured_on))
        print(reports.by_place(found) if published else reports.plain(here), end="\n\n")


def duet(asked: Asked) -> None:
    """Two people: completions, duets from words, answers and long duets."""
    if asked.get("write_bare"):
        from motionloom_lab.suites.duet_ways import write_bare

        return print(write_bare(Prior.load(asked["weights"]), asked["write_bare"]))
    out, command, found = asked.get("out"), options.commands()["duet"], {}
    parts = [asked["only"]] if asked.get("only") else ["completion", "text", "answers", "long"]
    jobs = {p: job_of(asked, options.typed(command, {**asked, "only": p}), out / p if out else None) for p in parts}
    for part, job in jobs.items():
        (suite,) = registry.chosen([f"duet-{part}"])
        found[part] = suite.run(job, asked)
        show(found[part], out / part if out else None, asked, published=True)
    if asked.get("json"):
        print(json.dumps({part: reports.encode(one) for part, one in found.items()}, indent=1))
    return None


def evaluator(asked: Asked) -> None:
    """What an evaluator notices, and whether it agrees with physics."""
    from motionloom_lab.suites.protocol import RECORDED

    if not 1 <= asked["repeats"] <= 10_000 or not 0 <= asked["seeds"] <= 1000:
        raise MotionloomError(
            f"repeats go from 1 to 10000 and seeds from 0 to 1000; got {asked['repeats']} and {asked['seeds']}"
        )
    out, found = asked.get("out"), []
    job = job_of(asked, options.typed(options.commands()["evaluator"], asked), out)
    if asked["seeds"]:
        job.tools.prior()  # what is quickly seen to be wrong goes first
    for suite in registry.chosen(["evaluator", *(["agreement"] if asked["seeds"] else [])]):
        found.append(suite.run(job, {**asked, "source": asked.get("source", [*RECORDED])}))
        show(found[-1], out / suite.name if out else None, asked, published=False)
    if asked.get("json"):
        print(json.dumps([reports.encode(report) for report in found], indent=1))


def study(asked: Asked) -> None:
    """One study of prediction."""
    from motionloom_lab.suites import prediction_studies as studies

    name, out = asked["name"], asked["out"]
    names = ("windows", "samples", "train_steps", "seed")
    changes = {key: asked[key] for key in names if key in asked}
    budget = studies.budget(name, quick=bool(asked.get("quick")), changes=changes)
    run = job_of(asked, options.typed(options.commands()["study"], asked), out).run("study")
    keep = asked.get("keep", out / "networks")
    values = studies.values_of(name, asked.get("values") or ())
    net = {key: asked[key] for key in studies.SIZES if asked.get(key) is not None}
    found = studies.run(name, run, protocol=asked.get("protocol"), keep=keep, budget=budget, values=values, net=net)
    print(reports.plain(found))
    print(f"\nwritten: {out / name}.md, .json, .png")


def make_reference(asked: Asked) -> None:
    """The real numbers that runs without --data show, for `text` or `transitions`."""
    from motionloom.core.features.representation import HUMANML3D
    from motionloom_lab.suites import measures, protocol, real_seams, text_reference
    from motionloom_lab.suites.items import built_of, fitting, read_items

    place, data, chosen = asked["make_reference"], asked.get("data"), measures.selection(asked)
    if data is None:
        raise MotionloomError("a reference is made of real motions; name them with --data")
    if asked["command"] == "text":
        from motionloom_lab.evaluator.evaluators import load_evaluator
        from motionloom_lab.suites.text import reference

        text_reference.check_reference(place)
        found = reference(load_evaluator(asked["evaluator"]), data, chosen, say)
        path = text_reference.save(found, place)
        return print(f"{path}: {len(found.names)} items, {path.stat().st_size / 1e6:.2f} MB")
    files.check_report(place)
    how, chosen = measures.with_asked(protocol.Transitions(), asked), fitting(data, chosen)
    if built_of(data) not in (None, HUMANML3D):
        raise MotionloomError(f"the numbers that ship are of {HUMANML3D}; name data of these")
    motions = [item.features for item in read_items(data, chosen)]
    crops = real_seams.SeamCrops.of(motions, how.window, None, seed=how.seed)
    source = f"{' + '.join(chosen.splits)} of {', '.join(chosen.sources) or 'all sources'}"
    files.write_json(place, real_seams.measure_shipped(crops, source=source, seed=how.seed))
    return print(f"{place}: {len(crops.motions)} windows, mean jerk {crops.mean_jerk:.6f} m/frame³")


def every(asked: Asked) -> int:
    """All suites, or those that are named."""
    from motionloom_lab.report import results
    from motionloom_lab.suites import everything

    wanted = registry.chosen(asked.get("only", ()))
    out = asked.get("out") or Path("out") / ("quick" if asked.get("quick") else "results")
    if asked.get("results"):
        results.check_page(asked["results"])
    again = bool(asked.get("again"))
    outcomes = everything.run_all(job_of(asked), out, wanted, keep=asked.get("keep"), again=again)
    made = [outcome.report for outcome in outcomes if outcome.report]
    for one in made:
        print(reports.plain(one), end="\n\n")
    if asked.get("results"):
        for name in results.fill_page(asked["results"], made, again=again):
            say(f"{asked['results']} keeps the full numbers of {name}; say --again to replace them by quick ones")
    for outcome in outcomes:
        print(f"{outcome.suite.name}: {outcome.summary}")
    return 2 if any(outcome.failed for outcome in outcomes) else 0


def compare(asked: Asked) -> int:
    """Two reports, or two folders of them."""
    from motionloom_lab.report import compare

    found, alone = compare.compare_all(asked["before"], asked["after"], anyway=bool(asked.get("anyway")))
    shown = found if asked.get("every") else [one for one in found if one.verdict in ("worse", "better", "other")]
    if asked.get("json"):
        print(json.dumps(compare.encode(shown), indent=1))
    else:
        if shown:
            print(files.plain(compare.table(shown)), end="\n\n")
        print(compare.tally(found))
        if alone:
            print(f"only one of the two has {', '.join(alone)}")
    return 1 if any(one.verdict == "worse" for one in found) else 0


# ---- by physics ------------------------------------------------------------------------------------------------------


def generator_of(asked: Asked) -> Generate:
    """The prior behind a plain function of prompts, length and seed."""
    from motionloom_lab.suites.harness import generator

    names = ("steps", "guidance", "solver", "best_of")
    prior = Prior.load(asked["weights"], device=asked["device"])
    return generator(prior, finished=_is_finished(asked), **{name: asked[name] for name in names if name in asked})


def _is_finished(asked: Asked) -> bool:
    """Whether motions are judged as `generate` writes them: with `--finished`, of obedience without `--sampled`."""
    return not asked.get("sampled") if "prompts" in asked else bool(asked.get("finished"))


def run_of(asked: Asked) -> Run:
    """Where and how it is measured."""
    return Run(asked["weights"], folder=asked.get("out"), device=asked["device"], progress=say)


def sampling_of(asked: Asked) -> dict[str, Any]:
    """How motions are sampled, for the file of results."""
    said = {name: asked.get(name) for name in ("weights", "steps", "guidance", "solver")}
    return {**said, "finished": _is_finished(asked)}


def write_page(asked: Asked, name: str, title: str, said: str, tables: Sequence[Sequence[Sequence[str]]]) -> None:
    """``NAME.md`` in ``--out``: what was found, its tables, and the weights, against which pages are held."""
    [(weights, mark)] = weight_marks([find_weights(asked["weights"])]).items()
    parts = [f"# {title} of {asked['weights']}", f"{said}.", *map(files.markdown, tables), f"Weights: {weights} {mark}"]
    files.write_text(asked["out"] / f"{name}.md", "\n\n".join(parts) + "\n")


def obedience(asked: Asked) -> None:
    """Everyday prompts, each with a physical check, on several seeds."""
    from motionloom.viz.film import suffixed
    from motionloom_lab.metrics.obedience import chosen, in_words
    from motionloom_lab.suites import obey
    from motionloom_lab.suites.reference import known

    checks = chosen(asked["prompts"], asked.get("only"))
    checks = in_words(checks, asked["words"]) if asked.get("words") else checks
    if asked.get("sheet"):
        files.check_report(suffixed(asked["sheet"], (".png",)))
    # 0 for the twenty of old, and 100 where seeds should be ones that nothing was chosen by
    seed = asked.get("seed", 0 if asked["prompts"] == "basic" else 100)
    settings = sampling_of(asked) | ({"best_of": asked["best_of"]} if asked["best_of"] > 1 else {})
    generate = obey.FirstDraws(generator_of(asked))
    results = obey.run(
        run_of(asked),
        checks,
        generate=generate,
        seeds=asked["seeds"],
        first_seed=seed,
        paraphrases=bool(asked.get("paraphrases")),
        settings=settings,
    )
    rows = obey.table(results, checks, real=known()["checks"] if asked["prompts"] != "everyday" else None)
    themes, said = obey.themes(results), obey.in_a_sentence(obey.totals(results, checks))
    more = [themes] if len(themes) > 1 else []
    if asked.get("out"):
        write_page(asked, "report", "Obedience", said, [*more, rows])
    if asked.get("sheet"):
        generate.draw(checks, asked["sheet"], seed=seed)
    if asked.get("json"):
        print(json.dumps(obey.summary(results, checks, settings=settings), indent=1))
    else:
        print("\n\n".join([*map(files.plain, [rows, *more]), said]))


def realism(asked: Asked) -> None:
    """Foot skate, penetration, jerk, bones, speeds and bodies against real people."""
    from motionloom_lab.suites import bodies, physical, realism

    count, out, data = asked["count"], asked.get("out"), asked.get("data")
    if not 1 <= count <= 100_000:
        raise MotionloomError(f"the count must be from 1 to 100000; got {count}")
    if out:
        files.check_report(out / "realism.json")
    wanted, real, _ = physical.realism_orders(data, count)
    if not wanted:
        raise MotionloomError(f"{data} has no held-out captioned clips of 2 to 10 s; leave --data out")
    reach = bodies.reach_of(asked["recordings"], say=say) if asked.get("recordings") else bodies.known()
    made, fps = realism.run(run_of(asked), wanted, generate=generator_of(asked), seed=asked.get("seed", 0))
    body = bodies.judge(made, reach)
    found = {"settings": sampling_of(asked), **realism.judge(made, fps, real), "body": body}
    tables = [realism.table(found), bodies.table(body)]
    said = (
        f"{found['passed']} of {len(tables[0]) - 1} numbers within 1.5 times of real (or too small to see), and "
        f"{body['passed']} of {body['of']} of the body within what recorded people do"
    )
    if not data:
        said += "; the real numbers are of other actions: name recordings with --data to compare like with like"
    if out:
        files.write_json(out / "realism.json", found)
        write_page(asked, "realism", "Realism", said, tables)
    print(json.dumps(found, indent=1) if asked.get("json") else "\n\n".join([*map(files.plain, tables), said]))


def manners(asked: Asked) -> None:
    """What a classifier of manners sees in motions of their sentences, and in people it did not learn from."""
    from motionloom_lab.suites import manners

    asked = {**asked, "finished": not asked.get("sampled")}
    seeds, out, known = asked["seeds"], asked.get("out"), manners.sentences()
    if not 0 <= seeds <= 1000:
        raise MotionloomError(f"the seeds of a sentence are from 0 to 1000; got {seeds}")
    only = asked.get("only") or list(known)
    check_names(only, known, "manners")
    if out:
        files.check_report(out / "manners.json")
    classifier, people = manners.trained(asked["data"], say)
    found: dict[str, Any] = {"kept_out": people}
    tables, said = [manners.rows(people)], f"people who were kept out: {manners.line(people)}"
    if seeds:
        generate = generator_of(asked)
        found["generated"] = manners.judge_motions(
            generate, classifier, seeds=seeds, seed=asked.get("seed", 0), only=only, progress=say
        )
        tables.append(manners.rows(found["generated"]))
        said += f"; generated motions: {manners.line(found['generated'])}"
    if out:
        files.write_json(out / "manners.json", {"settings": sampling_of(asked), **found})
        write_page(asked, "manners", "Manners", said, tables)
    print(json.dumps(found, indent=1) if asked.get("json") else "\n\n".join([*map(files.plain, tables), said]))


def reach(asked: Asked) -> None:
    """How recorded people hold their bodies."""
    from motionloom_lab.metrics.bodies import LEVELS
    from motionloom_lab.suites import bodies

    out = files.check_report(asked["out"]) if asked.get("out") else None
    found = {"percentiles": list(LEVELS), "reach": bodies.reach_of(asked["recordings"], say=say)}
    if out:
        files.write_json(out, found)
    print(json.dumps(found, indent=1))


def reference(asked: Asked) -> None:
    """Real clips by the basic checks."""
    from motionloom_lab.suites import reference
    from motionloom_lab.suites.items import real_clips

    out = files.check_report(asked["out"]) if asked.get("out") else None
    found = reference.reference(real_clips(asked["data"]), progress=say)
    if out:
        files.write_json(out, found)
    print(files.plain(reference.rates(found)))
    print("\nper cent of real clips of an action (rows) that pass each check (columns)\n")
    print(files.plain(reference.confusion_table(found)))


def checks(asked: Asked) -> None:
    """The everyday checks on real people who do what is asked, and on real people who don't."""
    from motionloom_lab.metrics.obedience import chosen
    from motionloom_lab.suites import trial
    from motionloom_lab.suites.items import real_clips
    from motionloom_lab.suites.trial import trials

    wanted = [check for check in chosen("everyday", asked.get("only")) if check.theme]
    if not wanted:
        raise MotionloomError("only everyday checks are tried here; 'motionloom evaluate reference' tries the others")
    out = asked.get("out")
    if out:
        files.check_report(out / "checks.json")
    clips = [clip for folder in asked["data"] for clip in real_clips(folder)]
    say(f"{len(clips)} real clips")
    found = trial.tried(wanted, trials(), clips, progress=say)
    rows = trial.table(found)
    said = (
        f"{sum(not tally.doubts() for tally in found.values())} of {len(found)} checks are sound on {len(clips)} real "
        f"clips: at least {trial.CAUGHT:.0%} of the examples pass, at most {trial.WRONG:.0%} of other actions, none of "
        "the other side, and neither standing nor walking"
    )
    if out:
        files.write_json(out / "checks.json", {"clips": len(clips), "checks": trial.summary(found)})
        files.write_text(out / "checks.md", f"# Everyday checks on real clips\n\n{said}.\n\n{files.markdown(rows)}\n")
    print(f"{files.plain(rows)}\n\n{said}")
    for name, tally in found.items() if asked.get("misses") else ():
        print(f"\n{name}", *(f"  missed  {line}" for line in tally.missed), sep="\n")
        print(*(f"  slipped {line}" for line in tally.slipped), sep="\n")

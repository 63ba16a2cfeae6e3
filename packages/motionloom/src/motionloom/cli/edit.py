"""`motionloom edit`: a clip changed by words."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from motionloom.cli.finished import Finished
from motionloom.cli.reading import check_size, crop, note_rate, read_clip
from motionloom.cli.sampling import (
    check_outs,
    check_prompt,
    load_prior,
    places,
    remark_unknown,
    report,
    request_of,
    results,
    write,
)
from motionloom.cli.skeletons import Target, put_all
from motionloom.cli.writing import at_rate, check_overwriting
from motionloom.io.bvh_writer import save_bvh
from motionloom.motion import Motion
from motionloom.requests.edit import Edit
from motionloom.retarget import to_smpl22
from motionloom.tasks.direct_edits import is_only_head_free
from motionloom.tasks.run import Models, Plan


def run_edit(arguments: argparse.Namespace) -> int:
    """``motionloom edit CLIP TEXT``."""

    uniform = arguments.skeleton in ("smpl", "smpl22")  # made so, rather than put on it afterwards
    arguments.skeleton = None if uniform or arguments.skeleton == "own" else arguments.skeleton
    outs, target = check_outs(arguments)
    if arguments.text is not None:
        check_prompt(arguments.text)
    captions = [arguments.text or arguments.clip.stem] * arguments.count
    captions = captions if target is None else target.names(captions)
    files = places(outs, arguments.count, target=target)
    clip, unit, orders = read_clip(arguments, arguments.clip)
    check_size(arguments, arguments.clip, clip)
    check_overwriting(arguments, [file for several in files for file in several])
    prior = load_prior(arguments)
    keep = [name.strip() for part in arguments.keep for name in part.split(",")]
    remarks = [] if is_only_head_free(keep) else remark_unknown(prior, [arguments.text or ""])
    unit, orders = (None, {}) if uniform else (unit, orders)
    made = Finished(
        files,
        arguments.count,
        _writer(captions, target, arguments.out_unit or unit, orders),
        put=lambda motions: put_all(target, at_rate(motions, arguments.fps)),
    )
    values = request_of(arguments, Edit, {"motion": clip, "prompt": arguments.text, "keep": keep})
    source = None if arguments.source is None else read_clip(arguments, arguments.source)[0]
    clip = crop(clip, arguments)
    people = (to_smpl22(clip) if uniform else clip,)
    plan = Plan(task="edit", values=values, sampling=values.sampling, people=people, target=source)
    versions = results("editing", plan, Models(prior))
    interrupted = made.take((list(one.people) for one in versions), measured=arguments.json)
    about = {
        "clip": str(arguments.clip),
        "prompt": arguments.text,
        "seeds": [arguments.seed + i for i in range(made.count)],
        "weights": str(arguments.weights),
        "remarks": remarks,
        "happened": made.happened,
    }
    report(arguments, about, made.written, made.sampling)
    note_rate(arguments, [arguments.clip])
    return made.ended(interrupted)


def _writer(
    captions: list[str], target: Target | None, unit: float | None, orders: dict[str, str]
) -> Callable[[Sequence[Motion], list[list[Path]], int], None]:
    """What writes versions; BVH files in the unit and the orders of rotations of the clip's own file."""

    def written(motions: Sequence[Motion], places: list[list[Path]], first: int) -> None:

        for several in places:
            if several[0].suffix.lower() != ".bvh" or target is not None:
                write(motions, several, captions[first : first + len(motions)], target)
                continue
            for motion, place in zip(motions, several, strict=True):
                save_bvh(motion, place, order=orders, unit=unit or 1.0)

    return written

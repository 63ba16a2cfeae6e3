"""`motionloom edit`: a clip changed by words."""

from argparse import Namespace

from motionloom.cli.reading import check_size, crop, note_rate, read_clip
from motionloom.cli.sampling import (
    check_outs,
    check_prompt,
    finished_motions,
    load_prior,
    places,
    remark_unknown,
    report,
    request_of,
    results,
)
from motionloom.cli.writing import check_overwriting
from motionloom.requests.tasks import Edit
from motionloom.retarget import to_smpl22
from motionloom.tasks.direct_edits import is_only_head_free
from motionloom.tasks.run import Models, Plan


def run_edit(arguments: Namespace) -> int:
    """``motionloom edit CLIP TEXT``."""
    uniform = arguments.skeleton in ("smpl", "smpl22")  # generated so, rather than put on it afterwards
    arguments.skeleton = None if uniform or arguments.skeleton == "own" else arguments.skeleton
    outs, target = check_outs(arguments)
    if arguments.text is not None:
        check_prompt(arguments.text)
    captions = [arguments.text or arguments.clip.stem] * arguments.count
    captions = target.names(captions)
    files = places(outs, arguments.count, target)
    clip, unit, orders = read_clip(arguments, arguments.clip)
    check_size(arguments, arguments.clip, clip)
    check_overwriting(arguments, [file for several in files for file in several])
    prior = load_prior(arguments)
    keep = [name.strip() for part in arguments.keep for name in part.split(",")]
    remarks = [] if is_only_head_free(keep) else remark_unknown(prior, [arguments.text or ""])
    target = target if uniform else target.like(unit, orders)
    output = finished_motions(files, captions, target, arguments.fps, first=True)
    values = request_of(arguments, Edit, {"motion": clip, "prompt": arguments.text, "keep": keep})
    source = None if arguments.source is None else read_clip(arguments, arguments.source)[0]
    clip = crop(clip, arguments)
    people = (to_smpl22(clip) if uniform else clip,)
    plan = Plan(task="edit", values=values, sampling=values.sampling, people=people, target=source)
    versions = results("editing", plan, Models(prior))
    interrupted = output.take((list(one.people) for one in versions), measured=arguments.json)
    about = {
        "clip": str(arguments.clip),
        "prompt": arguments.text,
        "seeds": [arguments.seed + i for i in range(output.count)],
        "weights": str(arguments.weights),
        "remarks": remarks,
        "happened": output.happened,
    }
    report(arguments, about, output.paths, output.sampling)
    note_rate(arguments, [arguments.clip])
    return output.ended(interrupted)

"""`motionloom edit`: a clip changed by words."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from motionloom.cli.newcomers import check_overwriting
from motionloom.cli.reading import add_reading, check_size, crop, note_rate, read_clip
from motionloom.cli.sampling import (
    add_sampling,
    bar,
    check_count,
    check_outs,
    check_prompt,
    load_prior,
    places,
    remark_unknown,
    report,
    sampling_of,
    take_text_anywhere,
    write,
)
from motionloom.cli.skeletons import put_all

if TYPE_CHECKING:
    from motionloom.motion import Motion
    from motionloom.weights.prior import Prior


def add(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Register `edit`."""
    parser = subparsers.add_parser(
        "edit",
        help="change parts of a motion file by words",
        description="Draw parts of a clip (.bvh, .amc with its .asf, .glb, .npz) anew; the rest stays as it is.",
    )
    parser.add_argument("clip", type=Path, metavar="CLIP")
    parser.add_argument("text", nargs="?", metavar="TEXT", help="what the person is to do, such as 'waves'")
    parser.add_argument(
        "--keep", action="append", default=[], metavar="PART",
        help="part that stays, repeatable: a joint, a group such as lower_body, root",
    )  # fmt: skip
    parser.add_argument(
        "--between", nargs=2, type=float, action="append", default=[], metavar=("FROM", "TO"),
        help="change only these seconds, repeatable",
    )  # fmt: skip
    parser.add_argument("--loop", action="store_true", help="make the end meet the beginning")
    parser.add_argument("--blend", type=float, default=1.0, help="seconds drawn anew for --loop (default 1)")
    parser.add_argument("--extend", type=float, default=0.0, metavar="SECONDS", help="go on behind the clip")
    parser.add_argument(
        "--strength", type=float, default=1.0, help="how far from the clip, above 0 to 1 (default 1: from noise alone)"
    )
    parser.add_argument("--seed", type=int, default=0, help="the first version's seed (default 0)")
    parser.add_argument("--count", type=int, default=1, help="versions to make (default 1)")
    parser.add_argument("--guidance", type=float, default=2.5, help="strength of the text (default 2.5)")
    add_sampling(parser, own_rate="the clip's", own_skeleton="own, the clip's")
    add_reading(parser)
    take_text_anywhere(parser)
    parser.set_defaults(run=run_edit)


def run_edit(arguments: argparse.Namespace) -> None:
    """``motionloom edit CLIP TEXT``."""
    uniform = arguments.skeleton in ("smpl", "smpl22")  # made so, rather than put on it afterwards
    arguments.skeleton = None if uniform or arguments.skeleton == "own" else arguments.skeleton
    outs, target = check_outs(arguments)
    check_count(arguments)
    if arguments.text is not None:
        check_prompt(arguments.text)
    captions = [arguments.text or arguments.clip.stem] * arguments.count
    files = places(outs, arguments.count, target=target)
    clip, unit, orders = read_clip(arguments, arguments.clip)
    check_size(arguments, arguments.clip, clip)
    check_overwriting(arguments, [file for several in files for file in several])
    prior = load_prior(arguments)
    remarks = remark_unknown(prior, [arguments.text or ""])
    motions, seconds = _make(arguments, prior, crop(clip, arguments), "smpl" if uniform else "own")
    motions = put_all(target, motions)
    if uniform:
        unit, orders = None, {}
    written = []
    for several in files:
        if several[0].suffix.lower() == ".bvh" and target is None:
            written += [_write_bvh(motion, place, unit, orders) for motion, place in zip(motions, several, strict=True)]
        else:
            written += write(motions, several, captions, target)
    about = {
        "clip": str(arguments.clip),
        "prompt": arguments.text,
        "seeds": [arguments.seed + i for i in range(arguments.count)],
        "weights": str(arguments.weights),
        "remarks": remarks,
    }
    report(arguments, about, written, seconds)
    note_rate(arguments, [arguments.clip])


def _make(
    arguments: argparse.Namespace, prior: "Prior", clip: "Motion", skeleton: "Literal['own', 'smpl']"
) -> "tuple[list[Motion], float]":
    import time

    from motionloom.tasks.edit import changes_asked, edit

    text, began = arguments.text or "", time.perf_counter()
    changes = changes_asked(
        text, keep=[name.strip() for part in arguments.keep for name in part.split(",")], loop=arguments.loop,
        between=[tuple(span) for span in arguments.between], blend=arguments.blend, extend=arguments.extend,
        strength=arguments.strength,
    )  # fmt: skip
    with bar("editing") as progress:
        motions = edit(
            prior, clip, text, changes, skeleton=skeleton, foot_lock=arguments.foot_lock, progress=progress,
            **sampling_of(arguments),
        )  # fmt: skip
    if arguments.fps is not None:
        motions = [motion.resample(arguments.fps) for motion in motions]
    return motions, time.perf_counter() - began


def _write_bvh(motion: "Motion", place: Path, unit: float | None, orders: dict[str, str]) -> Path:
    """In the unit and the orders of rotations of the clip's own file."""
    from motionloom.io.bvh_writer import save_bvh

    return save_bvh(motion, place, order=orders, unit=unit or 1.0)

"""`motionloom teach`: an action or a style from a user's own few clips, as a small file beside the weights."""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionloom.cli.sampling import fail, request_of
from motionloom.cli.tables import add_family
from motionloom.cli.writing import check_overwriting
from motionloom.core.errors import MotionloomError
from motionloom.formats import readable

if TYPE_CHECKING:
    from motionloom.core.motion import Motion
    from motionloom_train.data.examples import CaptionedClip, Example


def add(subparsers) -> None:
    """Register `teach`."""
    add_family(subparsers, __name__)


def run_teach(arguments: argparse.Namespace) -> int:
    """``motionloom teach TEXT CLIP ...``."""
    from motionloom.core.files.atomic import check_place
    from motionloom_train.data.examples import find_examples

    caption, places = _words(arguments.words)
    out = arguments.out or Path("taught.safetensors")
    if out.suffix.lower() != ".safetensors":
        fail(f"adapters are written as .safetensors; {out.name} has another suffix")
    if not arguments.check:
        check_place(out)
        check_overwriting(arguments, [out])
    captioned = find_examples(places, caption)
    motions, findings = _read(arguments, captioned)
    if arguments.check:
        return _report_check(arguments, captioned, findings)
    _refuse(captioned, findings)
    from motionloom_train.data.examples import make_examples

    examples = [
        example
        for one, motion in zip(captioned, motions, strict=True)
        for example in make_examples(motion, one, mirror=arguments.mirror)
    ]
    _teach(arguments, examples, out, captioned)
    return 0


def _words(words: list[str]) -> tuple[str, list[str]]:
    """The caption, which is no file and no folder and comes first or nowhere, and the clips."""
    caption, places = ("", words)
    first = words[0]
    if not Path(first).exists() and Path(first).suffix.lower() not in readable():
        caption, places = first, words[1:]
    if not places:
        fail(f"no clips behind {caption[:60]!r}; name files, as in: motionloom teach 'a zombie walks' clips/*.bvh")
    return caption, places


def _read(arguments: argparse.Namespace, captioned: "list[CaptionedClip]") -> "tuple[list[Motion], list[list[Any]]]":
    """The clips, and what is wrong with each."""
    from motionloom.io import load
    from motionloom_train.data.examples import check_file

    motions, findings = [], []
    for one in captioned:
        try:
            unit = arguments.unit if one.path.suffix.lower() in (".bvh", ".amc", ".npz") else None
            motions.append(load(one.path, fps=arguments.source_fps, unit=unit, up=arguments.up))
            findings.append(check_file(motions[-1]))
        except MotionloomError as error:
            findings.append(check_file(error))
    return motions, findings


def _report_check(arguments: argparse.Namespace, captioned: "list[CaptionedClip]", findings: list[list[Any]]) -> int:
    """Print what is wrong with which clip; the exit code is 2 where something cannot be learned from."""
    fatal = sum(any(one.fatal for one in own) for own in findings)
    if arguments.json:
        rows = [
            {
                "clip": str(one.path),
                "captions": list(one.captions),
                "wrong": [f.sentence for f in own if f.fatal],
                "remarks": [f.sentence for f in own if not f.fatal],
            }
            for one, own in zip(captioned, findings, strict=True)
        ]
        print(json.dumps({"clips": rows, "usable": len(captioned) - fatal}, indent=1, ensure_ascii=False))
        return 2 if fatal else 0
    for one, own in zip(captioned, findings, strict=True):
        print(f"{one.path}: {'; '.join(one.captions)}")
        for finding in own:
            print(f"  {'wrong' if finding.fatal else 'remark'}: {finding.sentence}")
    print(f"{len(captioned) - fatal} of {len(captioned)} clips can be learned from")
    return 2 if fatal else 0


def _refuse(captioned: "list[CaptionedClip]", findings: list[list[Any]]) -> None:
    """Raise MotionloomError for the first clip that nothing can be learned from; print the remarks."""
    for one, own in zip(captioned, findings, strict=True):
        for finding in own:
            if finding.fatal:
                fail(f"{one.path}: {finding.sentence}; leave it out or fix it ('motionloom teach --check' lists all)")
            print(f"motionloom: {one.path}: {finding.sentence}", file=sys.stderr)


def _teach(
    arguments: argparse.Namespace, examples: "list[Example]", out: Path, captioned: "list[CaptionedClip]"
) -> None:
    from motionloom.core.models.prior import Prior
    from motionloom_train.teach import Lesson, teach
    from motionloom_train.tensors import set_threads

    if arguments.threads is not None:
        if arguments.threads < 1:
            fail(f"--threads must be 1 or more; got {arguments.threads}")
        set_threads(arguments.threads)
    lesson = request_of(arguments, Lesson, {"name": arguments.name or out.stem})
    prior = Prior.load(arguments.weights, device=arguments.device)
    began = time.perf_counter()
    adapter = teach(prior, examples, lesson, device=arguments.device, say=lambda line: print(line, file=sys.stderr))
    adapter.save(out)
    about = {
        "file": str(out),
        "megabytes": round(out.stat().st_size / 1e6, 2),
        "captions": list(adapter.captions),
        "clips": [str(one.path) for one in captioned],
        "licence": adapter.licence,
        "base": adapter.base,
        "seconds": round(time.perf_counter() - began, 1),
    }
    if arguments.json:
        print(json.dumps(about, indent=1, ensure_ascii=False))
        return
    print(f"wrote {out}: {about['megabytes']} MB, {len(captioned)} clips, taught in {about['seconds']:.0f} s")
    print(f"try: motionloom generate {adapter.captions[0]!r} --adapter {out}")

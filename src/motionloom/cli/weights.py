"""`motionloom weights` and `motionloom import`: what a weight file is, and published checkpoints as one."""

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionloom.cli.writing import add_force, check_overwriting

if TYPE_CHECKING:
    import numpy as np

    from motionloom.weights.pair import PairBlock
    from motionloom.weights.predictor import Predictor
    from motionloom.weights.prior import Prior


def add(subparsers) -> None:
    """Register `import` and `weights`."""
    parser = subparsers.add_parser(
        "import", help="published weights to a file: an MDM, PriorMDM or HumanMAC network, or Guo's evaluator"
    )
    parser.add_argument(
        "checkpoint", type=Path, metavar="MODEL.pt|finest.tar", help="model000200000.pt, args.json beside it; or Guo's"
    )
    parser.add_argument("--out", type=Path, required=True, help="file to write, .safetensors")
    parser.add_argument("--mean", type=Path, help="Mean.npy of the data set, as its authors publish it; t2m_mean.npy")
    parser.add_argument("--std", type=Path, help="Std.npy of the data set; of an evaluator t2m_std.npy")
    parser.add_argument(
        "--glove", type=Path, metavar="FOLDER|FILE", help="an evaluator's words: our_vab_* files, or GloVe text"
    )
    parser.add_argument("--vip", type=Path, metavar="FILE", help="its special words: word_vectorizer.py, or JSON")
    parser.add_argument("--name", help="name on the card (default: the checkpoint's)")
    parser.add_argument("--licence", help="what one may do with these weights, as whoever gave them says")
    parser.add_argument("--half", action="store_true", help="write float16: half the size, nearly the same numbers")
    add_force(parser)
    parser.set_defaults(run=_import)
    parser = subparsers.add_parser(
        "weights", help="what a weight file holds, or which ones ship with motionloom; older files as ones of today"
    )
    parser.add_argument(
        "weights",
        nargs="*",
        metavar="NAME|FILE",
        help="a shipped name or a file (default: list the shipped); or: convert OLD.safetensors NEW.safetensors, which "
        "writes the graphs of its networks into a file that has none",
    )
    parser.add_argument(
        "--prior", type=Path, metavar="FILE", help="to convert a two-person block: the prior it belongs to, if not ours"
    )
    add_force(parser)
    parser.add_argument("--actions", action="store_true", help="list what a prior has learned, with seconds of each")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=_weights)


def _import(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.io.atomic import check_place
    from motionloom.lab.papers.commdm import is_pair
    from motionloom.lab.papers.humanmac_checkpoint import is_humanmac
    from motionloom.lab.papers.mdm import read_published
    from motionloom.lab.papers.published_priors import import_published
    from motionloom.weights.prior import save_prior

    if arguments.out.suffix != ".safetensors":
        raise MotionloomError(f"weights are written as .safetensors; {arguments.out.name} has another suffix")
    check_place(arguments.out)
    check_overwriting(arguments, [arguments.out])
    if not arguments.checkpoint.is_file():
        raise MotionloomError(f"there is no checkpoint {arguments.checkpoint}")
    if arguments.checkpoint.suffix == ".tar":
        _import_evaluator(arguments)
        return
    if arguments.glove or arguments.vip:
        raise MotionloomError("--glove and --vip belong to an evaluator, which is published as finest.tar")
    state = read_published(arguments.checkpoint).state
    if is_humanmac(state):
        _import_predictor(arguments)
        return
    if arguments.mean is None or arguments.std is None:
        raise MotionloomError(
            "the weights work on standardised features and do not hold the statistics: "
            "add --mean Mean.npy --std Std.npy of the data set they were trained on"
        )
    second = check_place(arguments.out.with_name(f"{arguments.out.stem}-pair.safetensors")) if is_pair(state) else None
    prior = import_published(
        arguments.checkpoint,
        mean=_numbers(arguments.mean),
        std=_numbers(arguments.std),
        name=arguments.name,
        licence=arguments.licence,
        warn=lambda line: print(f"motionloom: {line}", file=sys.stderr),
    )
    block = None if second is None else _imported_block(arguments, prior)
    print(f"wrote {save_prior(prior, arguments.out, half=arguments.half)}")
    if block is not None and second is not None:
        print(f"wrote {block.save(second, half=arguments.half)}, what makes two people of it")


def _imported_block(arguments: argparse.Namespace, prior: "Prior") -> "PairBlock":
    from motionloom.lab.papers.published_priors import import_block

    base = prior.card.name
    return import_block(arguments.checkpoint, prior, base=base, name=f"{base}-pair", licence=arguments.licence)


def _import_predictor(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.lab.papers.humanmac_checkpoint import import_humanmac
    from motionloom.weights.predictor import save_predictor

    if arguments.mean or arguments.std:
        raise MotionloomError("HumanMAC works on metres as they are: no --mean and no --std")
    made = import_humanmac(arguments.checkpoint, name=arguments.name, licence=arguments.licence)
    print(f"wrote {save_predictor(made, arguments.out, half=arguments.half)}")


def _import_evaluator(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.lab.papers.guo import read_published, save_guo

    if arguments.half:
        raise MotionloomError("an evaluator is kept as float32, so that its numbers are the published ones: no --half")
    card = {"name": arguments.name, "licence": arguments.licence}
    made = read_published(
        arguments.checkpoint,
        mean=arguments.mean,
        std=arguments.std,
        glove=arguments.glove,
        lists=arguments.vip,
        card={key: value for key, value in card.items() if value},
    )
    print(f"wrote {save_guo(made, arguments.out)}")
    for key, value in made.about.items():
        print(f"  {key:<14} {value}")


def _numbers(path: Path) -> "np.ndarray":
    """A small .npy array of numbers, without pickle."""
    from motionloom.errors import MotionloomError
    from motionloom.io.npz import read_array

    if not path.is_file():
        raise MotionloomError(f"there is no file {path}; name the Mean.npy and Std.npy published with the data set")
    return read_array(path, max_bytes=1 << 20)


def _weights(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.weights.pair import blocks
    from motionloom.weights.predictor import shipped_predictors
    from motionloom.weights.prior import find_weights, shipped

    if arguments.weights[:1] == ["convert"]:
        _convert(arguments)
        return
    if len(arguments.weights) > 1:
        raise MotionloomError(f"one weight file at a time; got {', '.join(arguments.weights)}")
    if arguments.prior is not None:
        raise MotionloomError(
            "--prior belongs to 'motionloom weights convert', which makes files of today from older ones"
        )
    if arguments.actions:
        _actions(arguments)
        return
    names = blocks() | shipped_predictors() | shipped()
    if not arguments.weights:
        described = [describe(path, name) for name, path in names.items()]
        if arguments.json:
            print(json.dumps(described, indent=1))
            return
        for about in described:
            print(f"{about['name']:<12} {about['kind']:<17} {about['megabytes']:6.1f} MB  {about['licence']}")
        if not described:
            print("no weights ship with this installation; name a file")
        return
    [asked] = arguments.weights
    about = describe(names.get(asked) or find_weights(asked), asked if asked in names else None)
    print(json.dumps(about, indent=1) if arguments.json else _card(about))


def _convert(arguments: argparse.Namespace) -> None:
    """Write an older file again with graphs; raises MotionloomError where it cannot be, or PyTorch is missing."""
    from motionloom.errors import MotionloomError
    from motionloom.io.atomic import check_place

    if len(arguments.weights) != 3 or arguments.actions or arguments.json:
        raise MotionloomError(
            "say which file to read and which to write: motionloom weights convert OLD NEW.safetensors"
        )
    old, new = map(Path, arguments.weights[1:])
    if new.suffix != ".safetensors":
        raise MotionloomError(f"weights are written as .safetensors; {new.name} has another suffix")
    if not old.is_file():
        raise MotionloomError(f"there is no file {old} to convert")
    check_place(new)
    check_overwriting(arguments, [new], also=[old])
    try:
        from motionloom.train.convert import convert
    except ImportError as error:
        raise MotionloomError(
            f"graphs are written by the training half, and {error.name or 'PyTorch'} is not installed: "
            "pip install 'motionloom[train]'"
        ) from None
    print(f"wrote {convert(old, new, prior=arguments.prior)}")


def _actions(arguments: argparse.Namespace) -> None:
    """Print what a prior has learned; raises MotionloomError for weights that do not say."""
    from motionloom.errors import MotionloomError
    from motionloom.weights.prior import Prior

    weights = arguments.weights[0] if arguments.weights else "default"
    known = Prior.load(weights).known
    if known is None:
        raise MotionloomError(
            f"the weights {weights!r} do not say what they have learned: they are older than "
            "such tables; their card says which recordings they know"
        )
    if arguments.json:
        about = {"seconds": dict(known.seconds), "sentences": list(known.sentences)}
        print(json.dumps(about, indent=1, ensure_ascii=False))
        return
    for action, seconds in known.seconds.items():
        print(f"{seconds:9.1f} s  {action}")
    print(f"{len(known.sentences):,} sentences for them are in the file; --json lists them")


def describe(path: Path, name: str | None = None) -> dict[str, Any]:
    """What a weight file says and holds; the whole file is read and checked. ``name``: the shipped one."""
    from motionloom.weights.adapter import is_adapter
    from motionloom.weights.pair import is_block
    from motionloom.weights.predictor import is_predictor

    kinds = ((is_predictor, _predictor), (is_block, _block), (is_adapter, _adapter))
    said = next((read for kind, read in kinds if kind(path)), _prior)(path)
    about = {"name": said["name"], "file": str(path), "megabytes": round(path.stat().st_size / 1e6, 1)} | said
    return about if name is None else about | {"name": name}


def _prior(path: Path) -> dict[str, Any]:
    from motionloom.weights.prior import load_prior

    prior = load_prior(path)
    config = prior.net.config
    about = _network(prior, "prior", config.variant, sizes={"patch": config.patch}, seen={"features": config.features})
    return about | {"text": prior.text.name, "notes": prior.card.notes}


def _predictor(path: Path) -> dict[str, Any]:
    from motionloom.weights.predictor import load_predictor

    predictor = load_predictor(path)
    frames = {"observed": predictor.observed, "predicted": predictor.frames - predictor.observed}
    seen = {"joints": list(predictor.layout.names), "frames": frames}
    sizes = {"frequencies": predictor.net.config.kept}
    return _network(predictor, "predictor", predictor.variant, sizes=sizes, seen=seen) | {"notes": predictor.card.notes}


def _network(
    whole: "Prior | Predictor", kind: str, variant: str, *, sizes: dict[str, int], seen: dict[str, Any]
) -> dict[str, Any]:
    """What there is to say of both kinds of networks, with their own ``sizes`` and what they see of a motion."""
    config = whole.net.config
    return {
        "name": whole.card.name,
        "kind": kind,
        "licence": whole.card.licence,
        "data": whole.card.data,
        "variant": variant,
        "parameters": sum(value.size for value in whole.net.weights.values()),
        "sizes": {"layers": config.layers, "width": config.width, "heads": config.heads} | sizes,
        **seen,
        "frames_per_second": whole.fps,
        "schedule": {"name": whole.schedule.name, "steps": whole.schedule.steps},
    }


def _block(path: Path) -> dict[str, Any]:
    from motionloom.weights.pair import read_block

    block = read_block(path)
    config = block.config
    return {
        "name": block.name,
        "kind": "two-person block",
        "licence": block.licence,
        "data": block.data,
        "variant": "aware" if config.aware else f"corrects {config.adds}",
        "parameters": sum(value.size for value in block.tensors.values()),
        "sizes": {"layers": config.layers, "behind": config.split, "width": config.width, "heads": config.heads},
        "belongs_to": {"name": block.base, "fingerprint": block.fingerprint},
        "notes": block.notes,
    }


def _adapter(path: Path) -> dict[str, Any]:
    from motionloom.weights.adapter import read_adapter

    adapter = read_adapter(path)
    return {
        "name": adapter.name,
        "kind": "taught adapter" if adapter.taught else "control adapter",
        "licence": adapter.licence,
        "data": adapter.data,
        "variant": "low rank" if adapter.taught else f"low rank, {adapter.control}",
        "parameters": sum(value.size for value in adapter.tensors.values()),
        "sizes": {"rank": adapter.rank} | ({"given rank": adapter.given_rank} if adapter.sees_given else {}),
        "belongs_to": {"name": adapter.base, "fingerprint": adapter.fingerprint},
        "notes": adapter.notes,
    }


def _card(about: dict[str, Any]) -> str:
    sizes = ", ".join(f"{key} {value}" for key, value in about["sizes"].items())
    rows = {
        "name": about["name"],
        "kind": about["kind"],
        "file": f"{about['file']} ({about['megabytes']} MB)",
        "licence": about["licence"],
        "data": about["data"],
        "network": f"{about['variant']}, {about['parameters']:,} parameters ({sizes})",
    }
    if "belongs_to" in about:
        rows["prior"] = f"{about['belongs_to']['name']} ({about['belongs_to']['fingerprint'][:12]}), no other"
    if "schedule" in about:
        rows["motion"] = f"{_seen(about)}, {about['frames_per_second']:g} frames per second"
        rows["schedule"] = f"{about['schedule']['name']}, {about['schedule']['steps']} levels"
    if "text" in about:
        rows["text"] = about["text"]
    rows["notes"] = json.dumps(about["notes"], ensure_ascii=False) if about["notes"] else "none"
    return "\n".join(f"{key:<9} {value}" for key, value in rows.items())


def _seen(about: dict[str, Any]) -> str:
    if "joints" not in about:
        return f"{about['features']} numbers per frame"
    return f"{len(about['joints'])} joints, {about['frames']['predicted']} frames after {about['frames']['observed']}"

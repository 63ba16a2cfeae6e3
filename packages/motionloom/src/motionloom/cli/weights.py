"""`motionloom weights`: what a weight file holds, which ones ship, and older files as ones of today."""

import json
from argparse import Namespace
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from motionloom.cli.writing import check_overwriting, fail
from motionloom.core.files.atomic import check_place
from motionloom.core.models.adapter import read_adapter
from motionloom.core.models.container import ADAPTERS, PAIRS, PREDICTORS
from motionloom.core.models.pair import blocks, read_block
from motionloom.core.models.predictor import Predictor, load_predictor, shipped_predictors
from motionloom.core.models.prior import Prior, find_weights, load_prior, shipped

TRAINING = "motionloom_train.convert"
"""The module that writes graphs, which needs PyTorch."""


def run_weights(arguments: Namespace) -> None:
    """``motionloom weights NAME``."""
    if arguments.weights[:1] == ["convert"]:
        _convert(arguments)
        return
    if len(arguments.weights) > 1:
        fail(f"one weight file at a time; got {', '.join(arguments.weights)}")
    if arguments.prior is not None:
        fail("--prior belongs to 'motionloom weights convert', which makes files of today from older ones")
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
    [name] = arguments.weights
    about = describe(names.get(name) or find_weights(name), name if name in names else None)
    print(json.dumps(about, indent=1) if arguments.json else _card(about))


def _convert(arguments: Namespace) -> None:
    """Write an older file again with graphs; raises MotionloomError where it cannot be, or PyTorch is missing."""
    if len(arguments.weights) != 3 or arguments.actions or arguments.json:
        fail("say which file to read and which to write: motionloom weights convert OLD NEW.safetensors")
    old, new = map(Path, arguments.weights[1:])
    if new.suffix != ".safetensors":
        fail(f"weights are written as .safetensors; {new.name} has another suffix")
    if not old.is_file():
        fail(f"there is no file {old} to convert")
    check_place(new)
    check_overwriting(arguments, [new], also=[old])
    convert = import_module(TRAINING).convert
    print(f"wrote {convert(old, new, prior=arguments.prior)}")


def _actions(arguments: Namespace) -> None:
    """Print what a prior has learned; raises MotionloomError for weights without it."""
    weights = arguments.weights[0] if arguments.weights else "default"
    known = Prior.load(weights).known
    if known is None:
        fail(
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
    """What a weight file is and holds; the whole file is read and checked. ``name``: the shipped one."""
    kinds = ((PREDICTORS, _predictor), (PAIRS, _block), (ADAPTERS, _adapter))
    facts = next((read for kind, read in kinds if kind.signed(path)), _prior)(path)
    about = {"name": facts["name"], "file": str(path), "megabytes": round(path.stat().st_size / 1e6, 1)} | facts
    return about if name is None else about | {"name": name}


def _about(whole: Any, kind: str, variant: str, tensors: Mapping[str, Any], *, own: dict[str, Any]) -> dict[str, Any]:
    """The facts of every kind of weights, and its ``own``; whole: what has their name, licence, data and notes."""
    return {
        "name": whole.name,
        "kind": kind,
        "licence": whole.licence,
        "data": whole.data,
        "variant": variant,
        "parameters": sum(value.size for value in tensors.values()),
        **own,
        "notes": whole.notes,
    }


def _sizes(config: Any) -> dict[str, int]:
    return {"layers": config.layers, "width": config.width, "heads": config.heads}


def _sampled(whole: Prior | Predictor) -> dict[str, Any]:
    schedule = {"name": whole.schedule.name, "steps": whole.schedule.steps}
    return {"frames_per_second": whole.fps, "schedule": schedule}


def _prior(path: Path) -> dict[str, Any]:
    prior = load_prior(path)
    config = prior.net.config
    own = {"sizes": _sizes(config) | {"patch": config.patch}, "features": config.features}
    own |= _sampled(prior) | {"text": prior.text.name}
    return _about(prior.card, "prior", config.variant, prior.net.weights, own=own)


def _predictor(path: Path) -> dict[str, Any]:
    predictor = load_predictor(path)
    config = predictor.net.config
    own = {
        "sizes": _sizes(config) | {"frequencies": config.kept},
        "joints": list(predictor.layout.names),
        "frames": {"observed": predictor.observed, "predicted": predictor.frames - predictor.observed},
        **_sampled(predictor),
    }
    return _about(predictor.card, "predictor", predictor.variant, predictor.net.weights, own=own)


def _belongs_to(part: Any) -> dict[str, Any]:
    return {"belongs_to": {"name": part.base, "fingerprint": part.fingerprint}}


def _block(path: Path) -> dict[str, Any]:
    block = read_block(path)
    config = block.config
    sizes = {"layers": config.layers, "behind": config.split, "width": config.width, "heads": config.heads}
    variant = "aware" if config.aware else f"corrects {config.adds}"
    return _about(block, "two-person block", variant, block.tensors, own={"sizes": sizes} | _belongs_to(block))


def _adapter(path: Path) -> dict[str, Any]:
    adapter = read_adapter(path)
    sizes = {"rank": adapter.rank} | ({"given rank": adapter.given_rank} if adapter.sees_given else {})
    kind = "taught adapter" if adapter.taught else "control adapter"
    variant = "low rank" if adapter.taught else f"low rank, {adapter.control}"
    return _about(adapter, kind, variant, adapter.tensors, own={"sizes": sizes} | _belongs_to(adapter))


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
        rows["motion"] = f"{_inputs_of(about)}, {about['frames_per_second']:g} frames per second"
        rows["schedule"] = f"{about['schedule']['name']}, {about['schedule']['steps']} levels"
    if "text" in about:
        rows["text"] = about["text"]
    rows["notes"] = json.dumps(about["notes"], ensure_ascii=False) if about["notes"] else "none"
    return "\n".join(f"{key:<9} {value}" for key, value in rows.items())


def _inputs_of(about: dict[str, Any]) -> str:
    if "joints" not in about:
        return f"{about['features']} numbers per frame"
    return f"{len(about['joints'])} joints, {about['frames']['predicted']} frames after {about['frames']['observed']}"

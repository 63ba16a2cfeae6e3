"""Readers of what was measured, and of plain containers."""

import json
import pickle
import zipfile
from pathlib import Path

import numpy as np

from tests.fuzz.reader import reader

# Measurements --------------------------------------------------------------------------------------------------------


def reports(folder: Path) -> None:
    from motionloom_lab.report.report import encode
    from tests_lab.report.test_report import report

    (folder / "report.json").write_text(json.dumps(encode(report())))


def read_reports(folder: Path) -> object:
    from motionloom_lab.report.compare import compare, load
    from motionloom_lab.report.report import markdown

    (one,) = load(folder).values()
    markdown(one)
    return compare(one, one)


def part(folder: Path) -> None:
    from motionloom_lab.suites.harness import Parts

    (folder / "parts").mkdir()
    Parts(folder, "settings").keep("one", {"a": 1.5, "b": 0.0})


def read_part(folder: Path) -> object:
    from motionloom_lab.suites.harness import Parts

    return Parts(folder, "settings").find("one")


def seams(folder: Path) -> None:
    from motionloom_lab.suites.real_seams import shipped_file

    (folder / "a.json").write_text(shipped_file().read_text())


def read_seams(folder: Path) -> object:
    from motionloom_lab.suites.real_seams import load_shipped

    return load_shipped(folder / "a.json")


def attempts(folder: Path) -> None:
    attempt = {"prompt": "walk", "seed": 1, "obeyed": True, "measured": {"speed": 1.2}}
    (folder / "a.json").write_text(
        json.dumps({"settings": {"a": 1}, "checks": [{"name": "walk", "attempts": [attempt]}]})
    )


def read_attempts(folder: Path) -> object:
    from motionloom_lab.suites.obey import _read

    return _read(folder / "a.json", {"a": 1})


def reference(folder: Path) -> None:
    from motionloom_lab.suites import text_reference
    from motionloom_lab.suites.protocol import Selection
    from tests_lab.suites.judged import Judge, item

    value = text_reference.measure([item(k, 40 + k) for k in range(5)], Judge(), Selection())
    text_reference.save(value, folder / "a.safetensors")


def read_reference(folder: Path) -> object:
    from motionloom_lab.suites import text_reference
    from tests_lab.suites.judged import Judge

    return text_reference.load(folder / "a.safetensors", Judge())


def guo_kept(folder: Path) -> None:
    from motionloom_lab.papers.guo import read_published, save_guo
    from tests_lab.papers.test_guo import files

    save_guo(read_published(files(folder), card={"licence": "research only"}), folder / "guo.safetensors")


def read_guo_kept(folder: Path) -> object:
    from motionloom_lab.papers.guo import is_guo, load_guo

    is_guo(folder / "guo.safetensors")
    return load_guo(folder / "guo.safetensors")


def plain(folder: Path) -> None:
    value = {"a": [np.arange(6.0).reshape(2, 3), "x", 3, None, (1, 2.5)], "b": {"c": np.array(["u", "v"]), "d": b"raw"}}
    (folder / "a.pkl").write_bytes(pickle.dumps(value, 2))


def read_plain(folder: Path) -> object:
    from motionloom_lab.papers.plain_pickle import read_plain_file

    return read_plain_file(folder / "a.pkl", limit=1 << 29)


def arrays(folder: Path) -> None:
    with zipfile.ZipFile(folder / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in (
            ("a", np.arange(12.0).reshape(3, 4)),
            ("b", np.array(["x", "yz"])),
            ("c", np.zeros((0, 3))),
        ):
            with archive.open(f"{name}.npy", "w") as member:
                np.save(member, array)


def read_arrays(folder: Path) -> object:
    from motionloom.io.npz import read_arrays

    return read_arrays(folder / "a.npz")


reader("report", reports, {"report.json": "json"}, read_reports)
reader("part of a measurement", part, {"parts/one.json": "json"}, read_part)
reader("real seams", seams, {"a.json": "json"}, read_seams)
reader("attempts", attempts, {"a.json": "json"}, read_attempts)
reader("text reference", reference, {"a.safetensors": "safetensors"}, read_reference)
reader("guo's evaluators kept", guo_kept, {"guo.safetensors": "safetensors"}, read_guo_kept, weight=6)
reader("plain pickle", plain, {"a.pkl": "pickle"}, read_plain)
reader("arrays", arrays, {"a.npz": "npz"}, read_arrays)

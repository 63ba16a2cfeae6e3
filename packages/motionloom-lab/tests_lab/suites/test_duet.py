"""Two people measured with made-up ways of completing them: errors, resumption, verdicts, reports."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.features import pair as two
from motionloom.core.features.pair import PairMotion
from motionloom.core.models.adapter import fingerprint
from motionloom.core.models.container import weights_digest
from motionloom.core.models.networks.prior_condition import condition
from motionloom.core.models.pair import PairBlock
from motionloom_lab.papers.mrt import Mrt, MrtConfig, MrtFile
from motionloom_lab.report import report as reports
from motionloom_lab.report.report import REAL
from motionloom_lab.suites import duet, duet_answers, duet_text
from motionloom_lab.suites import duet_ways as ways
from motionloom_lab.suites.duet import COLUMNS, ERRORS, LOOKS, Beside, CompletionSettings
from motionloom_lab.suites.duet_ways import FRAMES, Crops
from motionloom_lab.suites.harness import Run
from motionloom_lab.suites.items import NoData, pairs_of
from motionloom_train.export import pair_graph
from motionloom_train.modules import arrays
from motionloom_train.nets.pair import Talk, fitting
from tests.kinematics.people import FPS
from tests.noise import normal
from tests.recorded import tiny
from tests.recorded.tiny import WIDTH as TEXT
from tests_lab.suites.duets import block_over, couple, pair_of


def gliding(speed: float, seconds: float = 6.0) -> np.ndarray:
    """(2, frames, 22, 3): two who glide forward without moving a limb."""
    still = couple(seconds, speed=0.0)
    way = np.arange(still.shape[1])[:, None, None] * np.array([0.0, 0.0, speed / FPS])
    return still + way


def crops_of(positions: np.ndarray, count: int = 3, **how: Any) -> Crops:
    return duet.draw([pair_of(positions)], CompletionSettings(crops=count, **how))


def perfect(crops: Crops, sample: int) -> np.ndarray:
    return crops.positions[:, :, :FRAMES]


# Ways ----------------------------------------------------------------------------------------------------------------


def test_a_perfect_completion_has_no_error_and_looks_like_the_real_one() -> None:
    crops = crops_of(couple(6.0))
    scores = duet.score(crops, perfect, 2)
    real = duet.looks(crops.positions[:, :, :FRAMES])
    for name in ERRORS:
        assert np.array_equal(scores[name], np.zeros(3))
        assert np.array_equal(scores[f"mean_{name}"], np.zeros(3))
    for name in LOOKS:
        np.testing.assert_allclose(scores[name], real[name])


def test_standing_still_misses_who_glides_by_the_mean_of_the_way_gone() -> None:
    """After n frames v n / 20 metres are gone: v (20 k + 1) / 40 on average over the first k seconds."""
    crops = crops_of(gliding(1.5))
    still, steady = (duet.score(crops, way, 1) for way in (ways.standing(), ways.gliding()))
    for k in (1, 2, 3):
        np.testing.assert_allclose(still[f"root_{k}"], 1.5 * (20 * k + 1) / 40)
        np.testing.assert_allclose(still[f"joint_{k}"], 0, atol=1e-12)
        np.testing.assert_allclose(steady[f"root_{k}"], 0, atol=1e-9)
    np.testing.assert_allclose(still["speed"], 0)
    np.testing.assert_allclose(steady["speed"], 1.5)


def test_baselines_see_the_first_second_and_no_frame_more() -> None:
    crops = crops_of(couple(6.0))
    other = Crops(crops.positions.copy(), crops.numbers)
    other.positions[:, :, 20:] += 1.0
    still = ways.standing()(crops, 0)
    assert np.array_equal(still[:, :, :20], crops.positions[:, :, :20])
    assert np.array_equal(still[:, :, 20:], np.repeat(crops.positions[:, :, 19:20], 60, axis=2))
    mrt = ways.by_mrt(Mrt(MrtConfig(width=16, hidden=24, layers=1, heads=2, key=8)).eval())
    for way in (ways.standing(), ways.gliding(), mrt):
        assert np.array_equal(way(crops, 0), way(other, 0))


def test_the_mean_of_samples_can_be_right_where_every_sample_is_wrong() -> None:
    def scattered(crops: Crops, sample: int) -> np.ndarray:
        motions = perfect(crops, 0).copy()
        motions[:, :, 20:, :, 0] += 0.3 if sample % 2 else -0.3
        return motions

    scores = duet.score(crops_of(couple(6.0)), scattered, 2)
    np.testing.assert_allclose(scores["root_2"], 0.3)
    np.testing.assert_allclose(scores["mean_root_2"], 0, atol=1e-12)


@pytest.mark.parametrize(("given", "frames", "sees"), [("past", 20, 20), ("tool", 20, 21), ("published", 19, 20)])
def test_what_is_given_is_what_the_protocol_says(given: str, frames: int, sees: int) -> None:
    crop = couple(6.0)[:, : FRAMES + 1]
    other = crop.copy()
    other[:, sees:] += 1.0
    assert np.array_equal(ways.visible_part(crop, given), ways.visible_part(other, given))
    assert len(two.encode(ways.visible_part(crop, given)).features[0]) == frames
    other[:, sees - 1] += 0.1
    assert not np.array_equal(ways.visible_part(crop, given), ways.visible_part(other, given))


class Oracle:
    """In place of the sampler: it says what really came, and remembers what it was told."""

    def __init__(self, crops: Crops) -> None:
        self.asked: list[dict[str, Any]] = []
        encoded = [two.encode(crop) for crop in crops.positions]
        self.features = np.stack([one.features for one in encoded])

    def __call__(self, prior, net, prompts, frames, **how) -> PairMotion:
        self.asked.append({"prompts": prompts, "frames": frames, **how})
        return PairMotion(self.features[: len(prompts) // 2], np.zeros((len(prompts) // 2, 2, 4)))


@pytest.mark.parametrize(("given", "slots"), [("past", 21), ("tool", 21), ("published", 20)])
def test_a_sampler_that_knows_what_came_has_no_error(given: str, slots: int) -> None:
    positions = couple(6.0) + np.array([0.0, 0.3, 0.0])  # features call their lowest point 0, the world does not
    crops, prior = crops_of(positions), tiny.prior()
    oracle, net = Oracle(crops), ways.no_communication_net(tiny.prior())
    way = ways.sampled(prior, net, ways.CompletionSettings(given=given, steps=4), oracle)
    scores = duet.score(crops, way, 1)
    assert max(float(np.abs(scores[name]).max()) for name in ERRORS) < 1e-4
    call = oracle.asked[0]
    assert (call["frames"], call["prompts"]) == (FRAMES, [""] * 6)
    known, mask = call["edits"].observed.values, call["edits"].observed.mask
    assert known.shape == (6, 1 + FRAMES, 263)
    assert mask[:, :, 0].sum(1).tolist() == [slots] * 6
    place = net.places.encode(two.encode(crops.positions[1]).poses)
    np.testing.assert_allclose(known[2:4, 0, :4], place, atol=1e-5)
    held = (known[:2, 1:slots] * prior.std) + prior.mean
    local = oracle.features[0, :, : slots - 1]
    np.testing.assert_allclose(held[..., 4:67], local[..., 4:67], atol=1e-4)


def test_noise_goes_by_crop_and_sample_whatever_crops_are_beside() -> None:
    crops, prior = crops_of(couple(6.0), 4), tiny.prior()
    oracle = Oracle(crops)
    way = ways.sampled(prior, ways.no_communication_net(prior), ways.CompletionSettings(steps=4), oracle)
    way(crops, 0), way(crops.part(slice(2, 4)), 0), way(crops, 1)
    whole, part, again = (call["seeds"] for call in oracle.asked)
    assert whole[4:] == part
    assert len(set(whole) | set(again)) == 16


def test_a_real_sampler_of_random_weights_keeps_the_given_second() -> None:
    crops, prior = crops_of(couple(6.0), 2), tiny.prior()
    motions = ways.sampled(prior, ways.no_communication_net(prior), ways.CompletionSettings(steps=2))(crops, 0)
    assert motions.shape == (2, 2, FRAMES, 22, 3)
    np.testing.assert_allclose(motions[:, :, :20], crops.positions[:, :, :20], atol=2e-3)
    assert np.isfinite(motions).all()


@pytest.mark.parametrize("config", [tiny.MODULATED, tiny.PUBLISHED], ids=["modulated", "published"])
def test_layers_of_the_bare_prior_do_nothing(config) -> None:
    """What one frame says reaches no other, and words only through what all frames share."""
    prior = ways.bare(tiny.prior(config))
    words = normal((1, 5, TEXT))
    bound = prior.net.bind(condition(words.mean(1), tokens=words if config.variant == "modulated" else None))
    x = normal((1, 16, 263), 1)
    other = x.copy()
    other[:, 4:8] += 1.0
    apart = np.abs(prior.net(x, 3, bound) - prior.net(other, 3, bound)).max(-1)[0]
    assert apart[:4].max() < 1e-5
    assert apart[8:].max() < 1e-5
    assert apart[4:8].min() > 1e-3


def test_communication_only_takes_a_block_of_the_bare_prior_alone(tmp_path: Path) -> None:
    prior = tiny.prior()
    right = block_over(ways.bare(prior)).save(tmp_path / "right.safetensors")
    wrong = block_over(prior).save(tmp_path / "wrong.safetensors")
    silent, net = ways.only_communication(prior, right)
    assert fingerprint(silent.net) == fingerprint(ways.bare(prior).net) != fingerprint(prior.net)
    assert net.block.split == prior.net.config.layers
    with pytest.raises(MotionloomError, match="belongs to the weights"):
        ways.only_communication(prior, wrong)


# The table -----------------------------------------------------------------------------------------------------------


def test_crops_are_drawn_from_held_out_pairs_in_both_orders() -> None:
    long, short = pair_of(couple(6.0)), pair_of(couple(4.0), "short", "test")
    train = pair_of(couple(6.0), "train", "train")
    assert [pair.name for pair in duet.held_out([long, short, train])] == ["p"]
    crops = duet.draw([long], CompletionSettings(crops=40))
    assert np.array_equal(crops.positions, duet.draw([long], CompletionSettings(crops=40)).positions)
    first = crops.positions[:, 0, 0, 0, 0] - crops.positions[:, 1, 0, 0, 0]
    assert 5 < (first > 0).sum() < 35
    assert len({float(z) for z in crops.positions[:, 0, 0, 0, 2]}) > 10
    with pytest.raises(MotionloomError, match="no held-out pair of 81 frames"):
        duet.held_out([short, train])


def test_the_report_has_every_row_and_the_papers_table() -> None:
    crops = crops_of(gliding(1.0), 6)

    def off(crops: Crops, sample: int) -> np.ndarray:
        table = perfect(crops, 0).copy()
        table[:, :, 20:, :, 0] += 0.1
        return table

    methods = {"zero": ways.standing(), "constant": ways.gliding(), "silent": off, "ours": off, "mrt": perfect}
    how = CompletionSettings(crops=6, samples=2)
    table = duet.measure(crops, methods, how)
    here = [row for row in table.rows if not row.measured_on]
    assert [row.name for row in here] == [
        "real",
        "zero velocity",
        "constant velocity",
        "prior without communication, one sample",
        "prior without communication, mean of 2 samples",
        "ours, one sample",
        "ours, mean of 2 samples",
        "multi-range transformer",
    ]
    assert {row.name: row.values["root_3"].mean for row in here if row.name != REAL} == pytest.approx(
        {row.name: {"z": 1.525, "c": 0, "p": 0.1, "o": 0.1, "m": 0}[row.name[0]] for row in here if row.name != REAL}
    )
    table3 = {row.name: row for row in table.rows if row.measured_on}
    assert len(table3) == 10
    assert all("3DPW" in row.measured_on and set(row.values) == set(ERRORS) for row in table3.values())
    assert table3["ComMDM (1 layer, after layer 8)"].values["joint_3"].mean == 0.176
    zero = next(note for note in table.notes if "zero velocity" in note)
    assert "-0.425 ± 0.000 m at 1 s" in zero
    assert reports.decode(reports.encode(table)).row("zero velocity") is not None


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    crops, calls = crops_of(gliding(1.0), 20), []

    def counted(crops: Crops, sample: int) -> np.ndarray:
        calls.append(crops.numbers)
        return perfect(crops, sample)

    how = CompletionSettings(crops=20, samples=1)
    first = duet.measure(crops, {"ours": counted}, how, kinds=("ours",), run=Run(folder=tmp_path))
    assert calls == [tuple(range(16)), (16, 17, 18, 19)]
    assert duet.measure(crops, {"ours": counted}, how, kinds=("ours",), run=Run(folder=tmp_path)) == first
    assert len(calls) == 2
    assert first.rows[0].values["root_1"].count == 20
    with pytest.raises(MotionloomError, match="other settings"):
        duet.measure(crops, {"ours": counted}, replace(how, seed=1), kinds=("ours",), run=Run(folder=tmp_path))


def test_targets_that_cannot_be_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(duet, "blocks", dict)
    impossible: list[dict[str, Any]] = [{"crops": 0}, {"samples": 0}, {"given": "all"}, {"seed": -1}]
    for wrong in impossible:
        with pytest.raises(MotionloomError):
            CompletionSettings(**wrong)
    with pytest.raises(MotionloomError, match="no two-person block is shipped"):
        duet.chosen_block(None)
    with pytest.raises(MotionloomError, match="name some with --data"):
        pairs_of(None)
    with pytest.raises(NoData, match="has no pairs"):
        pairs_of(tmp_path)
    with pytest.raises(MotionloomError, match="is not a folder"):
        pairs_of(tmp_path / "none")
    (tmp_path / "x_a.bvh").write_text("")
    with pytest.raises(MotionloomError, match="has no partner") as error:
        pairs_of(tmp_path)
    assert not isinstance(error.value, NoData)
    with pytest.raises(MotionloomError, match="the rows are"):
        duet.run(Run(data=tmp_path), kinds=("best",))


def test_a_transformer_from_its_file_is_a_row(tmp_path: Path) -> None:
    config = MrtConfig(width=16, hidden=24, layers=1, heads=2, key=8)
    file = MrtFile(Mrt(config)).save(tmp_path / "mrt.safetensors")
    methods = duet.ways_of(tiny.prior(), None, CompletionSettings(), mrt=file)
    assert list(methods) == ["zero", "constant", "silent", "mrt"]
    motions = methods["mrt"](crops_of(couple(6.0), 2), 0)
    assert motions.shape == (2, 2, FRAMES, 22, 3)


def saved(prior, path: Path, name: str, **sizes: Any) -> Path:
    """A fresh block of other sizes, in a file."""
    talk = Talk(fitting(prior.net.config, **sizes), prior.net.config)
    graph = pair_graph(talk.config, prior.net.config)
    return PairBlock(name, talk.config, arrays(talk), "tiny", fingerprint(prior.net), graph=graph).save(path)


def test_other_blocks_are_rows_by_their_names_and_sizes(tmp_path: Path) -> None:
    prior, last = tiny.prior(), tiny.prior().net.config.layers
    files = [
        saved(prior, tmp_path / "x.safetensors", "layers2", layers=2, split=1),
        saved(prior, tmp_path / "y.safetensors", "known", aware=True),
    ]
    rows = duet.beside_rows(prior, files, ways.CompletionSettings(steps=2))
    assert [one.row for one in rows] == [
        "layers2: 2 layers after layer 1, not aware",
        f"known: 1 layer after layer {last}",
    ]
    assert rows[0].digest == weights_digest(files[0])[:12]  # graphs do not count
    silent = ways.sampled(prior, ways.no_communication_net(prior), ways.CompletionSettings(steps=2))
    motions, alone = (way(crops_of(couple(6.0), 2), 0) for way in (rows[0].way, silent))
    np.testing.assert_allclose(motions, alone, atol=1e-4)  # a fresh block says nothing


def test_two_blocks_of_one_name_and_blocks_of_another_prior_are_reported(tmp_path: Path) -> None:
    prior = tiny.prior()
    one = saved(prior, tmp_path / "one.safetensors", "same")
    two_of = saved(prior, tmp_path / "two.safetensors", "same", layers=2)
    with pytest.raises(MotionloomError, match="are called 'same'"):
        duet.beside_rows(prior, [one, two_of], ways.CompletionSettings(steps=2))
    with pytest.raises(MotionloomError, match=r"one\.safetensors belongs to the weights"):
        duet.beside_rows(ways.bare(prior), [one], ways.CompletionSettings(steps=2))
    with pytest.raises(MotionloomError, match="there is no such file"):
        duet.beside_rows(prior, [tmp_path / "none.safetensors"], ways.CompletionSettings(steps=2))


def test_a_block_beside_has_one_sample_and_a_new_one_leaves_what_is_done(tmp_path: Path) -> None:
    crops, calls = crops_of(gliding(1.0), 4), []

    def counted(name: str, off: float) -> Any:
        def way(crops: Crops, sample: int) -> np.ndarray:
            calls.append(name)
            motions = perfect(crops, 0).copy()
            motions[:, :, 20:, :, 0] += off
            return motions

        return way

    how, kinds = CompletionSettings(crops=4, samples=2), ("ours",)
    first, again, second = (
        Beside(f"{name}: 1 layer", digest, counted(digest, off))
        for name, digest, off in [("b", "1", 0.1), ("b", "1", 0.1), ("b", "2", 0.3)]
    )
    ours = {"ours": counted("ours", 0.0)}
    motions = duet.measure(crops, ours, how, kinds=kinds, beside=[first], run=Run(folder=tmp_path))
    here = [row for row in motions.rows if not row.measured_on]
    assert [row.name for row in here] == ["ours, one sample", "ours, mean of 2 samples", "b: 1 layer"]
    assert here[2].values["root_2"].mean == pytest.approx(0.1)
    assert any(
        "less that of b: 1 layer, crop by crop" in note and "-0.100 ± 0.000 m at 1 s" in note for note in motions.notes
    )
    assert motions.protocol["blocks beside"] == {"b: 1 layer": "1"}
    assert calls == ["ours", "ours", "1"]
    assert duet.measure(crops, ours, how, kinds=kinds, beside=[again], run=Run(folder=tmp_path)) == motions
    assert len(calls) == 3
    other = duet.measure(crops, ours, how, kinds=kinds, beside=[second], run=Run(folder=tmp_path))
    assert calls[3:] == ["2"]
    assert other.rows[2].values["root_2"].mean == pytest.approx(0.3)


# The command ---------------------------------------------------------------------------------------------------------


def test_the_command_tells_what_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "duet", "--data", str(tmp_path), "--weights", "none.safetensors"]) == 2
    assert "none.safetensors" in capsys.readouterr().err
    assert main(["evaluate", "duet", "--data", str(tmp_path), "--train-mrt", "5"]) == 2
    assert "--out FOLDER" in capsys.readouterr().err


def test_columns_have_different_names() -> None:
    for columns in (COLUMNS, duet_text.COLUMNS, duet_answers.COLUMNS):
        assert len({column.name for column in columns}) == len({column.title for column in columns}) == len(columns)

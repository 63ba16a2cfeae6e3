"""CLIP and DistilBERT, with tiny random models in a folder: no download, and what transformers itself computes."""

import json
import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom_lab.papers import text_model
from motionloom_train.nets.text import ClipText, DistilBert

LETTERS = "abcdefghijklmnopqrstuvwxyz"
CLIP_PIECES = [*LETTERS, *(f"{letter}</w>" for letter in LETTERS), ".</w>", "<|startoftext|>", "<|endoftext|>"]
BERT_PIECES = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", "walk", "##s", "left", "right", "a", "."]
LONG = "abcdefghijklmnopqrstuvwxyzabcdefghij"  # 36 pieces


@pytest.fixture(scope="module")
def transformers() -> Any:
    return pytest.importorskip("transformers", reason="the extra 'clip' or 'distilbert' is not installed")


@pytest.fixture(autouse=True)
def offline(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")


@pytest.fixture(scope="module")
def clip_folder(tmp_path_factory: pytest.TempPathFactory, transformers: Any) -> Path:
    folder = tmp_path_factory.mktemp("clip")
    torch.manual_seed(0)
    sizes = {"hidden_size": 16, "intermediate_size": 32, "num_hidden_layers": 2, "num_attention_heads": 2}
    marks = {"bos_token_id": len(CLIP_PIECES) - 2, "eos_token_id": len(CLIP_PIECES) - 1}
    text = {**sizes, **marks, "vocab_size": len(CLIP_PIECES), "projection_dim": 16}
    vision = {**sizes, "image_size": 8, "patch_size": 4, "projection_dim": 16}
    config = transformers.CLIPConfig(text_config=text, vision_config=vision, projection_dim=16)
    model = transformers.CLIPModel(config)
    for value in model.parameters():
        torch.nn.init.normal_(value, std=0.3)
    model.save_pretrained(folder)
    (folder / "vocab.json").write_text(json.dumps({piece: place for place, piece in enumerate(CLIP_PIECES)}))
    (folder / "merges.txt").write_text("#version: 0.2\n")
    settings = {"tokenizer_class": "CLIPTokenizer", "unk_token": "<|endoftext|>", "pad_token": "<|endoftext|>"}
    settings |= {"bos_token": "<|startoftext|>", "eos_token": "<|endoftext|>"}
    (folder / "tokenizer_config.json").write_text(json.dumps(settings))
    return folder


@pytest.fixture(scope="module")
def bert_folder(tmp_path_factory: pytest.TempPathFactory, transformers: Any) -> Path:
    folder = tmp_path_factory.mktemp("distilbert")
    torch.manual_seed(0)
    config = transformers.DistilBertConfig(
        vocab_size=len(BERT_PIECES), dim=16, hidden_dim=32, n_layers=2, n_heads=2, max_position_embeddings=24
    )
    model = transformers.DistilBertModel(config)
    for value in model.parameters():
        torch.nn.init.normal_(value, std=0.3)
    model.save_pretrained(folder)
    (folder / "vocab.txt").write_text("\n".join(BERT_PIECES) + "\n")
    (folder / "tokenizer_config.json").write_text(json.dumps({"tokenizer_class": "DistilBertTokenizer"}))
    return folder


def test_clip_ids_are_start_twenty_pieces_and_end(clip_folder: Path) -> None:
    encoder = ClipText.open(clip_folder)
    start, end = len(CLIP_PIECES) - 2, len(CLIP_PIECES) - 1
    assert encoder.ids("A cab.") == [start, 26, 2, 0, 27, 52, end]
    assert encoder.ids("") == [start, end]
    with pytest.warns(UserWarning, match="20 word pieces"):
        assert encoder.ids(LONG) == [start, *range(20), end]
    assert len(ClipText.open(clip_folder, length=77).ids(LONG)) == 38


def test_clip_pooled_is_the_projected_end_state_of_ids_padded_with_zeros_to_77(
    clip_folder: Path, transformers: Any
) -> None:
    """The published layout: 20 pieces and both marks, then zeros up to the context length."""
    encoder = ClipText.open(clip_folder)
    texts = ["a cab", "", LONG[:15], "walk left."]
    model = transformers.CLIPModel.from_pretrained(clip_folder).eval()
    ids = torch.zeros(len(texts), 77, dtype=torch.long)
    for row, text in enumerate(texts):
        ids[row, : len(encoder.ids(text))] = torch.tensor(encoder.ids(text))
    end = ids.argmax(1)
    with torch.no_grad():
        states = model.text_model(input_ids=ids).last_hidden_state
        expected = model.text_projection(states[torch.arange(len(texts)), end])
    out = encoder.encode(texts)
    np.testing.assert_allclose(out.pooled, expected.numpy(), atol=1e-5, rtol=1e-4)
    states = states[:, : out.mask.shape[1]].numpy()
    np.testing.assert_allclose(out.tokens[out.mask], states[out.mask], atol=1e-5, rtol=1e-4)
    assert out.mask.sum(1).tolist() == (end + 1).tolist()
    assert encoder.width == 16


def test_distilbert_tokens_are_transformers_last_hidden_states(bert_folder: Path, transformers: Any) -> None:
    encoder = DistilBert.open(bert_folder)
    out = encoder.encode(["Walks left.", "a", ""])
    assert encoder.ids("Walks left.") == [2, 5, 6, 7, 10, 3]
    assert out.mask.sum(1).tolist() == [6, 3, 2]
    model = transformers.DistilBertModel.from_pretrained(bert_folder).eval()
    for row, text in enumerate(["Walks left.", "a", ""]):
        ids = torch.tensor([encoder.ids(text)])
        with torch.no_grad():
            expected = model(input_ids=ids).last_hidden_state[0]
        np.testing.assert_allclose(out.tokens[row, : len(expected)], expected.numpy(), atol=1e-5, rtol=1e-4)
        np.testing.assert_allclose(out.pooled[row], expected.mean(0).numpy(), atol=1e-5, rtol=1e-4)
    with pytest.warns(UserWarning, match="22 word pieces"):
        assert encoder.encode("walk " * 10_000).tokens.shape == (1, 24, 16)


def test_both_are_text_encoders_of_arrays(clip_folder: Path, bert_folder: Path) -> None:
    encoders: list[TextEncoder] = [ClipText.open(clip_folder), DistilBert.open(bert_folder)]
    assert [encoder.name for encoder in encoders] == ["clip", "distilbert"]
    assert all(isinstance(encoder.encode("left").tokens, np.ndarray) for encoder in encoders)


def test_without_transformers_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(MotionloomError, match=r"motionloom-train\[clip\]"):
        ClipText.open("nowhere")
    with pytest.raises(MotionloomError, match=r"motionloom-train\[distilbert\]"):
        DistilBert.open("nowhere")


@pytest.mark.usefixtures("transformers")
def test_missing_files_are_one_sentence(tmp_path: Path) -> None:
    for place in (tmp_path, tmp_path / "absent", "no-such-owner/no-such-model"):
        with pytest.raises(MotionloomError, match="hf download") as caught:
            ClipText.open(place)
        assert "\n" not in str(caught.value)


def test_a_missing_weight_is_not_replaced_by_chance(clip_folder: Path, tmp_path: Path) -> None:
    for file in clip_folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    tensors = load_file(clip_folder / "model.safetensors")
    rest = {name: value for name, value in tensors.items() if name != "text_projection.weight"}
    save_file(rest, tmp_path / "model.safetensors", {"format": "pt"})
    with pytest.raises(MotionloomError, match=r"text_projection\.weight"):
        ClipText.open(tmp_path)


def test_pickled_weights_are_converted_not_loaded(clip_folder: Path, tmp_path: Path) -> None:
    for file in clip_folder.iterdir():
        if file.suffix != ".safetensors":
            (tmp_path / file.name).write_bytes(file.read_bytes())
    torch.save(load_file(clip_folder / "model.safetensors"), tmp_path / "pytorch_model.bin")
    with pytest.raises(MotionloomError, match=r"papers\.text_model"):
        ClipText.open(tmp_path)
    text_model.convert(tmp_path)
    expected = ClipText.open(clip_folder).encode("a cab")
    np.testing.assert_allclose(ClipText.open(tmp_path).encode("a cab").pooled, expected.pooled, atol=1e-6)


class Bomb:
    def __reduce__(self) -> tuple[Any, ...]:
        return (print, ("a pickle ran",))


HOSTILE = [b"", b"PK\x03\x04junk", pickle.dumps(Bomb(), 2), pickle.dumps([1, 2], 2)]


@pytest.mark.parametrize("content", HOSTILE, ids=["empty", "junk", "code", "no weights"])
def test_hostile_pickles_are_refused_and_never_run(
    content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "pytorch_model.bin").write_bytes(content)
    with pytest.raises(MotionloomError, match=r"pytorch_model\.bin"):
        text_model.convert(tmp_path)
    assert "a pickle ran" not in capsys.readouterr().out
    assert not (tmp_path / "model.safetensors").exists()

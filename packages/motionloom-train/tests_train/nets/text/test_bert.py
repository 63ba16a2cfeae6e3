"""BERT as a module against transformers' BERT."""

import pytest
import torch

from motionloom_train.nets.text.bert import Bert, from_huggingface


def test_renamed_weights_give_what_transformers_gives() -> None:
    transformers = pytest.importorskip("transformers", reason="the extra 'clip' is not installed")
    torch.manual_seed(0)
    config = transformers.BertConfig(
        vocab_size=50, hidden_size=64, num_hidden_layers=2, num_attention_heads=2, intermediate_size=96
    )
    theirs = transformers.BertModel(config).eval()
    for value in theirs.parameters():
        torch.nn.init.normal_(value, std=0.2)
    ours = Bert(vocabulary=50, places=16, width=64, heads=2, hidden=96, layers=2)
    ours.load_state_dict(from_huggingface(theirs.state_dict(), places=16))
    ids = torch.randint(0, 50, (3, 9))
    mask = torch.arange(9) < torch.tensor([9, 5, 2])[:, None]
    with torch.no_grad():
        expected = theirs(input_ids=ids, attention_mask=mask.long()).last_hidden_state
        torch.testing.assert_close(ours(ids, mask)[mask], expected[mask], atol=2e-5, rtol=0)

"""The requests by the names of their tasks."""

from collections.abc import Mapping

from motionloom.requests.compose import Compose
from motionloom.requests.control import Control
from motionloom.requests.duet import Duet
from motionloom.requests.edit import Edit
from motionloom.requests.generate import Generate
from motionloom.requests.predict import Predict, Switch

REQUESTS: Mapping[str, type] = {
    "generate": Generate,
    "compose": Compose,
    "control": Control,
    "edit": Edit,
    "predict": Predict,
    "switch": Switch,
    "duet": Duet,
}

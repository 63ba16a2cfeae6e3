"""Drawings: path data against known points, and whatever a stranger's file holds."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.goals.drawing import MAX_PIECES, read_drawing
from tests.work import ends

SVG = '<svg xmlns="http://www.w3.org/2000/svg">{}</svg>'


@pytest.fixture
def draw(tmp_path: Path):
    """Points of a drawing on the page (x to the right, y down), from its first point."""

    def points(inside: str) -> np.ndarray:
        (tmp_path / "d.svg").write_text(SVG.format(inside), encoding="utf-8")
        return -read_drawing(tmp_path / "d.svg")

    return points


def test_up_on_the_page_is_forward_and_left_is_left(draw) -> None:
    """Somebody who walks up the page goes along +Z, and their left, +X, is the page's left."""
    assert (-draw('<line x1="5" y1="5" x2="5" y2="2"/>'))[-1].tolist() == [0, 3]
    assert (-draw('<line x1="5" y1="5" x2="2" y2="5"/>'))[-1].tolist() == [3, 0]


@pytest.mark.parametrize(
    ("data", "end"),
    [
        ("M10 10 L13 14", (3, 4)),
        ("m10 10 l3 4 1 1", (4, 5)),
        ("M10,10 13,14", (3, 4)),
        ("m10 10 3 4", (3, 4)),
        ("M1 1H5V-2", (4, -3)),
        ("M1 1h4v-3h1", (5, -3)),
        ("M0 0L5 0 5 5z", (0, 0)),
        ("M0 0L5 0 5 5zl1 2", (1, 2)),
        ("M0 0C1 0 2 1 3 3s2 3 4 4", (7, 7)),
        ("M0 0Q1 0 2 1T4 4t1 1", (5, 5)),
        ("M0 0a5 5 0 0110 0", (10, 0)),
        ("M-1-2L.5.5-1e1-.5", (-9, 1.5)),
        ("M5 5M1 1L2 3", (1, 2)),
    ],
    ids=lambda value: value.replace(" ", "_") if isinstance(value, str) else "",
)
def test_commands_end_where_they_say(draw, data: str, end: tuple[float, float]) -> None:
    assert draw(f'<path d="{data}"/>')[-1] == pytest.approx(end, abs=1e-9)


def test_a_half_circle_is_round_and_bulges_to_its_side(draw) -> None:
    """Sweep 1 from left to right goes over the top of the page, sweep 0 under it."""
    over, under = (draw(f'<path d="M0 0A5 5 0 0 {sweep} 10 0"/>') for sweep in (1, 0))
    for points, top in ((over, -5), (under, 5)):
        assert np.linalg.norm(points - [5, 0], axis=-1) == pytest.approx(5)
        assert points[np.abs(points[:, 0] - 5).argmin()] == pytest.approx([5, top], abs=0.05)
    large = draw('<path d="M0 0A5 5 0 1 1 5 5"/>')
    assert large[:, 0].max() == pytest.approx(10, abs=0.01)  # the centre is (5, 0)
    assert draw('<path d="M0 0A1 1 0 0 1 10 0"/>')[:, 1].min() == pytest.approx(-5, abs=0.01)  # too small: scaled up
    tilted = draw('<path d="M0 0A10 5 90 0 1 0 20"/>')  # the long half axis stands upright
    assert tilted[:, 0].max() == pytest.approx(5, abs=0.01)


def test_cubics_and_quadratics_go_through_their_middle(draw) -> None:
    """At half of the parameter (p0 + 3 p1 + 3 p2 + p3) / 8; a mirrored handle goes straight through the knot."""
    assert draw('<path d="M0 0C0 8 8 8 8 0"/>')[24] == pytest.approx([4, 6])
    assert draw('<path d="M0 0Q4 8 8 0"/>')[24] == pytest.approx([4, 4])
    assert draw('<path d="M0 0C0 8 8 8 8 0S16 -8 16 0"/>')[72] == pytest.approx([12, -6])
    assert draw('<path d="M0 0Q4 8 8 0T16 0"/>')[72] == pytest.approx([12, -4])
    assert draw('<path d="M0 0L8 0T16 0"/>')[25, 1] == 0  # no curve before it: a straight line


def test_shapes_and_transforms(draw) -> None:
    assert draw('<polyline points="0,0 1,1 2,5"/>').tolist() == [[0, 0], [1, 1], [2, 5]]
    assert draw('<polygon points="0 0 1 1 2 5"/>').tolist() == [[0, 0], [1, 1], [2, 5], [0, 0]]
    circle = draw('<circle cx="50" cy="5" r="2"/>')
    assert circle[len(circle) // 4] == pytest.approx([-2, 2])
    ellipse = draw('<ellipse rx="4" ry="1"/>')
    assert np.ptp(ellipse, axis=0) == pytest.approx([8, 2])
    line = '<line x2="1"/>'
    assert draw(f'<g transform="translate(7 7) rotate(90)"><g transform="scale(3)">{line}</g></g>')[-1] == (
        pytest.approx([0, 3])
    )
    assert draw(f'<g transform="scale(3) skewY(45), matrix(0 1 -1 0 9 9)">{line}</g>')[-1] == pytest.approx([0, 3])
    assert draw(f'<g transform="rotate(180 4 4)">{line}</g>')[-1] == pytest.approx([-1, 0])


def test_what_is_not_drawn_is_not_walked(draw) -> None:
    assert draw('<defs><g><line x2="9"/></g></defs><g><rect/><line y2="1"/></g><line x2="5"/>')[-1].tolist() == [0, 1]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no xml",
        "<html/>",
        "<svg>",
        "<svg/>",
        '<svg><path d=""/></svg>',
        '<svg><path d="M0 0"/></svg>',
        '<svg><path d="L1 1"/></svg>',
        '<svg><path d="M0 0L1"/></svg>',
        '<svg><path d="M0 0Lx 1"/></svg>',
        '<svg><path d="M0 0L1 1M5 5L6 6"/></svg>',
        '<svg><path d="M0 0A1 1 0 2 0 3 3"/></svg>',
        '<svg><path d="M0 0L1e99 1"/></svg>',
        '<svg><path d="M0 0Z1 1"/></svg>',
        '<svg><path d="M0 0L0 0"/></svg>',
        '<svg><circle r="-1"/></svg>',
        '<svg><circle r="50%"/></svg>',
        '<svg><polyline points="1 2 3"/></svg>',
        '<svg transform="spin(3)"><line x2="1"/></svg>',
        '<svg transform="rotate(1 2)"><line x2="1"/></svg>',
        '<svg transform="scale(0)"><line x2="1"/></svg>',
        '<!DOCTYPE svg [<!ENTITY a "M0 0">]><svg><path d="&a;L1 1"/></svg>',
        '<!DOCTYPE svg SYSTEM "file:///etc/passwd"><svg><line x2="1"/></svg>',
        '<?xml version="1.0" encoding="klingon"?><svg/>',
        "<svg>" + "<g>" * 2000 + '<line x2="1"/>' + "</g>" * 2000 + "</svg>",
        f'<svg><path d="M0 0{"l1 1" * (MAX_PIECES + 1)}"/></svg>',
    ],
    ids=range(26),
)
def test_bad_drawings_are_one_sentence(text: str, tmp_path: Path) -> None:
    (tmp_path / "d.svg").write_text(text)
    with pytest.raises(MotionloomError) as error:
        read_drawing(tmp_path / "d.svg")
    assert str(error.value).startswith(str(tmp_path / "d.svg"))
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


DATA = st.text(alphabet="MLHVCSQTAZmlhvcsqtaz0123456789.,- e+", max_size=60)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150)
@given(DATA, st.sampled_from(["", "rotate(30)", "scale(2,", "matrix(1 2 3 4 5 6)"]))
@example("M0 0A1e-9 1e9 0 1 0 5 5", "")
@example("M0 0A1e9 1e9 0 1 0 1e-9 0", "")
def test_any_path_data_are_points_or_a_sentence(tmp_path: Path, data: str, transform: str) -> None:
    (tmp_path / "d.svg").write_text(f'<svg><path transform="{transform}" d="M1 2{data}"/></svg>')
    try:
        points = read_drawing(tmp_path / "d.svg")
    except MotionloomError:
        return
    assert np.isfinite(points).all()
    assert points.shape[1] == 2
    assert (points[0] == 0).all()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100)
@given(st.binary(max_size=200))
def test_any_bytes_are_a_sentence(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "d.svg").write_bytes(b"<svg>" + data)
    with pytest.raises(MotionloomError):
        read_drawing(tmp_path / "d.svg")


@pytest.mark.parametrize("transform", ["rotate(1){}x", "rotate(1){}(", "rotate{}x", "rotate(1 {} x)"])
def test_a_transform_with_very_many_blanks_takes_no_endless_time(draw, transform: str) -> None:
    """Refused, and within seconds of the processor: blanks are never read twice."""

    def refused() -> None:
        with pytest.raises(MotionloomError, match=r"transform|number"):
            draw(f'<line transform="{transform.format(" " * 200_000)}" x2="1"/>')

    assert ends(refused)

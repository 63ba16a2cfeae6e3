"""What the documents say is true: their commands run, their Python runs, their links lead somewhere.

In README.md a code block under ``<!-- run -->`` is executed, block after block in one empty folder. Every other
``motionloom ...`` line of any document only has to be accepted by the parser, and every ``make`` line to be a target.
"""

import os
import re
import runpy
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from motionloom import cli

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
TIMELINES = sorted((ROOT / "examples" / "timelines").glob("*.yaml"))
BLOCK = re.compile(r"(<!-- run -->\n)?```(sh|python)\n(.*?)```", re.DOTALL)
WEIGHTS = sorted((ROOT / "packages" / "motionloom" / "src" / "motionloom" / "weights").glob("*.safetensors"))
needs_weights = pytest.mark.skipif(not WEIGHTS, reason="no shipped weights")


def blocks(text: str) -> list[tuple[bool, str, str]]:
    """(is it run?, language, code) of every shell and Python block."""
    return [(bool(mark), language, code) for mark, language, code in BLOCK.findall(text)]


def commands(text: str, program: str) -> list[str]:
    """The lines of the shell blocks that call ``program``, continued lines joined, comments removed."""
    lines = [
        line
        for _, language, code in blocks(text)
        if language == "sh"
        for line in code.replace("\\\n", " ").splitlines()
    ]
    return [line for line in lines if line.split("#")[0].split()[:1] == [program]]


def execute(command: list[str], folder: Path) -> None:
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    environment = {**os.environ, "PATH": path, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all of the README's blocks: later ones use the files of earlier ones."""
    return tmp_path_factory.mktemp("readme")


FILLER = runpy.run_path(str(ROOT / "tools" / "fill_readme.py"))
fill, places = FILLER["fill"], FILLER["places"]
RUN = [(language, code) for run, language, code in blocks(README) if run]


@needs_weights
@pytest.mark.slow
@pytest.mark.parametrize(("language", "code"), RUN, ids=[f"block{i}" for i in range(len(RUN))])
def test_the_readmes_blocks_run(language: str, code: str, folder: Path) -> None:
    """Every marked block of the README ends without an error."""
    execute(["bash", "-euo", "pipefail", "-c", code] if language == "sh" else [sys.executable, "-c", code], folder)


def test_the_readme_has_marked_blocks_of_both_kinds() -> None:
    """The marker is spelled as this file expects, so the test above has something to run."""
    assert {"sh", "python"} == {language for language, _ in RUN}


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda p: p.stem)
def test_the_examples_run(example: Path, tmp_path: Path) -> None:
    """Each numbered example runs from an empty folder."""
    if not WEIGHTS and "Prior" in example.read_text():
        pytest.skip("no shipped weights")
    execute([sys.executable, str(example)], tmp_path)


@needs_weights
@pytest.mark.slow
def test_the_timelines_become_motions() -> None:
    """Each timeline of the examples is made, in few steps, to its last frame; what it goes on from and to is met."""
    from motionloom import Prior, compose, load
    from motionloom.goals.timeline import read_timeline

    prior = Prior.load()
    for example in TIMELINES:
        asked = read_timeline(example)
        start = None if asked.start is None else load(asked.start)
        made = compose(prior, asked.segments, path=asked.path, start=start, seed=asked.seed or 0, steps=3)
        assert len(made) == asked.frames, example.name
        if asked.path is not None:
            apart = (made.root - asked.path.positions[:, 0])[:, [0, 2]]
            assert abs(apart).max() < 0.05, example.name
        if start is not None:
            assert abs(made.root[0] - start.root[-1])[[0, 2]].max() < 0.2, example.name


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_documented_commands_exist(document: Path) -> None:
    """Every `motionloom` line names a command with options it has; every `make` line names a target."""
    text = document.read_text()
    for line in commands(text, "motionloom"):
        if "--help" in line or "--version" in line or "--schema" in line:
            continue
        try:
            cli.parser().parse_args(shlex.split(line, comments=True)[1:])
        except SystemExit:
            pytest.fail(f"{document.name}: the command line does not know: {line}")
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for line in commands(text, "make"):
        words = [w for w in shlex.split(line, comments=True)[1:] if "=" not in w]
        assert set(words) <= targets, f"{document.name}: no such target: {line}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_links_lead_to_files(document: Path) -> None:
    """Every relative link and picture of a document is there."""
    text = re.sub(r"```.*?```", "", document.read_text(), flags=re.DOTALL)
    targets = [t.split("#")[0] for t in re.findall(r"\]\(([^)\s]+)\)", text) if not re.match(r"[a-z]+:|#", t)]
    missing = [t for t in targets if not (document.parent / t).exists() and (WEIGHTS or not t.endswith(".png"))]
    assert not missing, f"{document.name} links to {missing}"


def headings(document: Path) -> set[str]:
    """The anchors of a document's headings, as GitHub makes them."""
    text = re.sub(r"```.*?```", "", document.read_text(), flags=re.DOTALL)
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    plain = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title).strip().lower() for title in titles]
    return {re.sub(r"[^\w -]", "", title).replace(" ", "-") for title in plain}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_links_lead_to_headings(document: Path) -> None:
    """What stands behind the # of a link is a heading of the document."""
    text = re.sub(r"```.*?```", "", document.read_text(), flags=re.DOTALL)
    links = re.findall(r"\]\(([^)\s#:]*)#([^)\s]+)\)", text)
    places = [(document.parent / name if name else document, anchor) for name, anchor in links]
    lost = [anchor for place, anchor in places if place.suffix == ".md" and anchor not in headings(place)]
    assert not lost, f"{document.name} links to headings that are not there: {lost}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_named_files_exist(document: Path) -> None:
    """Every path of the project that a document names in backticks is there."""
    if document.name == "CHANGELOG.md":
        pytest.skip("history may name what is gone")
    pattern = r"`((?:packages|tests|docs|examples|tools|benchmarks|recipes)/[\w./-]+)`"
    named = set(re.findall(pattern, document.read_text()))
    assert not [n for n in named if not (ROOT / n).exists()]


FIGURE_PAGES = FILLER["documents"]()


@needs_weights
@pytest.mark.parametrize("page", FIGURE_PAGES, ids=lambda path: path.stem)
def test_figures_are_of_the_weights_that_ship_or_say_so(page: Path) -> None:
    """Each marked place is what its file says, and names its weights where these are not the shipped ones.

    It fails as soon as a weight file changes; `make tables` then marks the places, and measuring anew clears the marks.
    """
    assert fill(page.read_text()) == page.read_text(), "run: make tables"


def test_every_suite_of_the_results_says_of_which_weights_it_is() -> None:
    openings = re.findall(r"<!-- suite [^\n]*-->", (ROOT / "docs" / "results.md").read_text())
    assert openings
    assert not [one for one in openings if not re.search(r"; of [\w-]+ [0-9a-f]{12}", one)]


def test_every_study_is_as_the_command_writes_it() -> None:
    """A study of given weights is one marked place, which names them as its protocol does; others train their own."""
    for page in sorted((ROOT / "docs" / "studies").glob("*.md")):
        found = re.findall(r"<!-- figures; of ([^\n]+) -->", page.read_text())
        assert found == re.findall(r"^- files: (.+)$", page.read_text(), re.MULTILINE), page.name
        assert bool(found) == (page.stem in ("hold", "horizon", "steps", "switch")), page.name


WITHOUT_WEIGHTS = {
    *("against.txt", "batch.txt", "studio.txt", "blender_vertices.txt", "bvh_elsewhere.txt", "characters.txt"),
    "runtime.txt",
    *("everyday_checks/checks.md", "releases/README.md"),
}
"""Tables of speed, files and recordings: nothing in them depends on what weights have learned."""


def test_every_measured_table_names_its_weights() -> None:
    folder = ROOT / "benchmarks"
    tables = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.suffix in (".md", ".txt")}
    unnamed = {name for name, path in tables.items() if not FILLER["MEASURED"].search(path.read_text())}
    assert unnamed == WITHOUT_WEIGHTS


def test_no_figure_of_the_readme_stands_outside_of_a_marked_place() -> None:
    """Shares, counts of seeds and intervals are filled in; whoever types one here has to mark it."""
    plain = FILLER["PLACE"].sub("", README)
    assert not re.findall(r"\d+(?:\.\d+)? ?%|\b\d+ of \d+\b|±", plain)
    assert places(README)
    assert all(places(README).values()), "a table of the README is empty"


MEASURED_SHARE = re.compile(
    r"±|\b\d+ of (?:the )?\d+ (?:draws|seeds|prompts|sentences|motions|commands|skeletons|characters|clips|rigs)\b"
)


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda path: path.stem)
def test_no_measured_share_of_a_page_stands_outside_of_a_marked_place(page: Path) -> None:
    """Who measures writes the table or the marked place; examples of notation are in backticks."""
    plain = FILLER["PLACE"].sub("", page.read_text())
    assert not MEASURED_SHARE.findall(re.sub(r"```.*?```|`[^`\n]*`", "", plain, flags=re.DOTALL))


def test_a_changed_weight_file_is_noticed(tmp_path: Path) -> None:
    """A place of other weights begins with a sentence, once; measured again on what ships it loses it."""
    weights = tmp_path / "packages" / "motionloom" / "src" / "motionloom" / "weights"
    weights.mkdir(parents=True)
    (weights / "default.safetensors").write_bytes(b"new")
    mark = FILLER["shipped"](weights)["default"]
    text = "a\n<!-- figures; of default 0123456789ab -->\n7 of 8\n<!-- end -->\nb\n"
    marked = fill(text, tmp_path)
    assert "-->\n*Measured on earlier weights (default 0123456789ab).*\n\n7 of 8\n<!-- end -->" in marked
    assert fill(marked, tmp_path) == marked
    assert fill(marked.replace("0123456789ab", mark), tmp_path) == text.replace("0123456789ab", mark)
    with pytest.raises(ValueError, match="twelve digits"):
        fill(text.replace("0123456789ab", "lately"), tmp_path)


def test_tables_are_filled_from_files(tmp_path: Path) -> None:
    """A marked place takes its file's text and weights once, however often it is filled; one without a file stays."""
    (tmp_path / "a.md").write_text("# Title\n\n| 1 |\n\nWeights: default 0123456789ab\n")
    (tmp_path / "b.txt").write_text("x  y\n")
    text = "".join(f"<!-- filled from {name} -->\nold\n<!-- end -->\n" for name in ("a.md", "b.txt", "c.md"))
    once = fill(text, tmp_path, {"default": "0123456789ab"})
    assert places(once) == {"a.md": "| 1 |", "b.txt": "```text\nx  y\n```", "c.md": "old"}
    assert "<!-- filled from a.md; of default 0123456789ab -->" in once
    assert fill(once, tmp_path, {"default": "0123456789ab"}) == once


def test_a_table_may_be_shown_by_some_of_its_columns(tmp_path: Path) -> None:
    other = "| a |\n| --- |\n| 9 |\n\n"
    (tmp_path / "a.md").write_text(
        f"# Title\n\nmade\n\n| x | y | z |\n| --- | --- | --- |\n| 1 |  | 3 |\n\n{other}end\n"
    )
    text = "<!-- filled from a.md: z, x -->\n<!-- end -->\n"
    assert places(fill(text, tmp_path)) == {"a.md": "made\n\n| z | x |\n| --- | --- |\n| 3 | 1 |\n\nend"}
    assert fill(fill(text, tmp_path), tmp_path) == fill(text, tmp_path)
    with pytest.raises(ValueError, match="w"):
        fill("<!-- filled from a.md: w -->\n<!-- end -->\n", tmp_path)


def test_the_readme_is_short_and_shows_five_pictures_and_one_table() -> None:
    lines = README.splitlines()
    assert len(lines) < 150
    assert max(map(len, lines)) <= 120
    assert len(re.findall(r"!\[.+\]\(docs/pictures/", README)) == 5
    assert len(places(README)) == 1


def test_contributing_fits_one_screen() -> None:
    """CONTRIBUTING.md has at most 50 lines of at most 120 characters."""
    lines = (ROOT / "CONTRIBUTING.md").read_text().splitlines()
    assert len(lines) <= 50
    assert max(map(len, lines)) <= 120


def test_blocks_are_told_apart() -> None:
    """The little parser of this file knows a marked block from a plain one and joins continued lines."""
    text = textwrap.dedent(
        """
        <!-- run -->
        ```sh
        motionloom a \\
          --b  # why
        ```
        ```python
        x = 1
        ```
        """
    )
    assert [(run, language) for run, language, _ in blocks(text)] == [(True, "sh"), (False, "python")]
    assert [shlex.split(line, comments=True) for line in commands(text, "motionloom")] == [["motionloom", "a", "--b"]]


DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))


@pytest.mark.parametrize("page", DECISIONS, ids=lambda path: path.stem)
def test_a_decision_is_one_page_with_a_status(page: Path) -> None:
    """Its title carries its number, a status line stands below it, and it has at most 60 lines."""
    title, _, status, *_ = page.read_text().splitlines()
    assert title.startswith(f"# {page.name[:4]}: ")
    assert re.match(r"\*\*Status\*\*: (accepted|superseded by \[\d{4}\]\(\d{4})", status)
    assert len(page.read_text().splitlines()) <= 60


@pytest.mark.parametrize("page", DECISIONS, ids=lambda path: path.stem)
def test_the_figures_of_a_decision_name_their_weights(page: Path) -> None:
    """Its status says by their hash of which weights they are, or that they do not depend on any."""
    status = page.read_text().split("\n\n")[1]
    if "igures " in status or "Sizes " in status:
        assert re.search(r"`[0-9a-f]{12}`|depend", status), status

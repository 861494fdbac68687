"""A link that somebody planted where a command writes is not followed: what it leads to stays as it is, and nothing but
the output is left beside it."""

# ruff: noqa: F811 - the fixtures of export_run
import pytest
from conftest import STUDY
from export_run import export, run_file  # noqa: F401

KEPT = "what the link leads to\n"

WRITERS = {
    "plot": ("a.png", "plot RUN a.png"),
    "figure": ("a.svg", "plot --figure energy RUN a.svg"),
    "numbers": ("a.csv", "plot --figure energy RUN a.csv"),
    "report": ("a.html", "report RUN -o a.html --rerun never"),
    "still": ("a.png", "render RUN a.png --size 64x64"),
    "film": ("a.mp4", "render RUN a.mp4 --size 64x64 --no-rerun"),
    "pov": ("a.pov", "render RUN a.pov --pov"),
    "compared.csv": ("a.csv", "compare RUN RUN --csv a.csv"),
    "compared.html": ("a.html", "compare RUN RUN --html a.html"),
    "compared.png": ("a.png", "compare RUN RUN --png a.png"),
    "balls.csv": ("a.csv", "export RUN a.csv"),
    "gsd": ("a.gsd", "export RUN a.gsd"),
    "vtp": ("a.vtp", "export RUN a.vtp"),
    "pvd": ("a.pvd", "export RUN a.pvd"),
    "stl": ("a.stl", "export RUN a.stl"),
    "sweep": ("a.parquet", "sweep a.study -o a.parquet -q"),
    "study.csv": ("a.csv", "study t.parquet --csv a.csv"),
    "study.html": ("a.html", "study t.parquet --html a.html"),
}

DRAWN = ("still", "film", "pov")


@pytest.fixture(scope="session")
def table(tmp_path_factory):
    """A table of a study, once; made by the first who needs it."""
    return tmp_path_factory.mktemp("table") / "t.parquet"


@pytest.mark.slow
@pytest.mark.parametrize("place", ["{}", "{}.part", "{}.new"])
@pytest.mark.parametrize(
    "writer", [pytest.param(name, marks=pytest.mark.render) if name in DRAWN else name for name in WRITERS]
)
def test_a_planted_link_is_not_followed(mill, run_file, table, write_study, tmp_path, writer, place):
    target, words = WRITERS[writer]
    before = set()
    if ".study" in words or "t.parquet" in words:
        write_study(STUDY.replace("300, 600, 900 rpm", "600, 900 rpm").replace("40..60 step 20", "40, 50"))
        if not table.exists() and "t.parquet" in words:
            assert mill("sweep", "a.study", "-o", table, "-q").returncode == 0
        before = {path.name for path in tmp_path.iterdir()}
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    victim = elsewhere / "victim.txt"
    victim.write_text(KEPT)
    link = tmp_path / place.format(target)
    link.symlink_to(victim)
    names = {"RUN": str(run_file), "t.parquet": str(table)}
    done = mill(*(names.get(word, word) for word in words.split()))
    assert victim.read_text() == KEPT
    assert list(elsewhere.iterdir()) == [victim]
    assert not (tmp_path / target).is_symlink() or (done.returncode == 2 and target in done.stderr), done.stderr
    assert done.returncode == 0 or (done.returncode == 2 and done.stderr.count("\n") == 1), done.stderr
    own = {target, link.name, "elsewhere", *{"a.pvd": ["a"], "a.parquet": ["a.png"]}.get(target, [])}
    assert {path.name for path in tmp_path.iterdir()} <= own | before


@pytest.mark.parametrize("name", ["a.h5.lock", "a.h5.part", "a.h5.new"])
def test_millsim_follows_no_link_beside_its_output(millsim, small_deck, tmp_path, name):
    (tmp_path / name).symlink_to(tmp_path / "elsewhere")
    done = millsim(small_deck, "-q", "-o", "a.h5")
    assert not (tmp_path / "elsewhere").exists()
    assert done.returncode == 2 and name in done.stderr and "move it away" in done.stderr
    done = millsim(small_deck, "-q", "-f", "-o", "a.h5")
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "elsewhere").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.h5", "deck.ini"]

"""A link that somebody planted where a command writes is not followed: what it leads to stays as it is, and nothing but
the output is left beside it."""

# ruff: noqa: F811 - the fixtures of export_run
import pytest
from conftest import STUDY, some
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
    "xlsx": ("a.xlsx", "export RUN a.xlsx"),
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


def writers(every):
    """Names of WRITERS for parametrize, with their marks; see some()."""
    marks = {name: [pytest.mark.render] if name in DRAWN else [] for name in WRITERS}
    marks |= dict.fromkeys(("sweep", "plot"), [pytest.mark.slow])
    marks["compared.html"] = [pytest.mark.thorough]  # takes longer than all others
    return [pytest.param(*one.values, marks=[*one.marks, *marks[one.values[0]]]) for one in some(WRITERS, every)]


@pytest.fixture
def follows_no_link(mill, run_file, table, write_study, tmp_path):
    """follows_no_link(writer, places): links at these places, of which {} is the output, are not followed."""

    def check(writer, *places):
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
        links = {place.format(target) for place in places}
        for link in links:
            (tmp_path / link).symlink_to(victim)
        names = {"RUN": str(run_file), "t.parquet": str(table)}
        done = mill(*(names.get(word, word) for word in words.split()))
        assert victim.read_text() == KEPT
        assert list(elsewhere.iterdir()) == [victim]
        assert not (tmp_path / target).is_symlink() or (done.returncode == 2 and target in done.stderr), done.stderr
        assert done.returncode == 0 or (done.returncode == 2 and done.stderr.count("\n") == 1), done.stderr
        own = {target, *links, "elsewhere", *{"a.pvd": ["a"], "a.parquet": ["a.png"]}.get(target, [])}
        assert {path.name for path in tmp_path.iterdir()} <= own | before

    return check


@pytest.mark.parametrize("writer", writers(5))
def test_a_link_in_the_place_of_the_output_is_not_followed(follows_no_link, writer):
    follows_no_link(writer, "{}")


@pytest.mark.parametrize("writer", writers(4))
def test_links_beside_the_output_are_not_followed(follows_no_link, writer):
    follows_no_link(writer, "{}.part", "{}.new")


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

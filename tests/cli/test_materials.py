"""Materials, and a restitution that falls with the speed."""

import h5py
import numpy as np
import pytest
from conftest import SMALL

FLOOR = 5e-3  # [m/s]
SMOOTH = SMALL.replace("friction = 0.3", f"friction = 0\nrebound_floor = {FLOOR} m/s")
SMOOTH = SMOOTH.replace("time = 50 ms", "time = 300 ms") + "impacts = all\n"
STEEL = (
    SMALL.replace("density = 7800 kg/m^3", "material = steel")
    .replace("length = 40 mm", "length = 40 mm\nmaterial = glass")
    .replace("restitution = 0.8\nfriction = 0.3\n", "")
)
ROWS = "# v e\n0.05 0.97\n0.3 0.9\n2 0.5\n"


def impacts(path):
    """Normal speed and restitution of the impacts that the rebound floor did not change: without friction all of the
    dissipation is (1 - e^2) m v^2 / 2, with the reduced mass m."""
    with h5py.File(path) as file:
        log = {name: file[f"impacts/{name}"][()] for name in ("kind", "normal_speed", "dissipation")}
        mass = float(file["particles/trajectory/mass"][0])
    v = log["normal_speed"]
    loss = 2 * log["dissipation"] / (np.where(log["kind"] == 0, mass / 2, mass) * v**2)
    free = (v > 1e-3) & (np.sqrt(np.maximum(1 - loss, 0)) * v > 3.01 * FLOOR)  # in bursts
    return v[free], np.sqrt(1 - loss[free])


def law(text, kind):
    """Restitution (a number, or the name of its table), friction and tangential restitution in the full deck."""
    lines = text.split(f"[contact.{kind}]\n")[1].split("\n\n")[0].splitlines()
    found = {key: value.strip() for key, value in (line.split("#")[0].split(" = ") for line in lines)}
    e = float(found["restitution"]) if "restitution" in found else found["restitution_table"]
    return e, float(found["friction"]), float(found["tangential_restitution"])


@pytest.fixture
def run(millsim, write_deck, tmp_path):
    """Runs a deck; returns its output file."""

    def go(text, *sets):
        write_deck(text)
        done = millsim("-q", *(word for one in sets for word in ("-s", one)), "--force", "-o", "run.h5", "deck.ini")
        assert done.returncode == 0, done.stderr
        return tmp_path / "run.h5"

    return go


@pytest.fixture
def full(millsim, write_deck):
    """The full deck of a deck, and what --check says beside it."""

    def check(text, *sets):
        write_deck(text)
        done = millsim("--check", *(word for one in sets for word in ("-s", one)), "deck.ini")
        assert done.returncode == 0, done.stderr
        return done.stdout, done.stderr

    return check


class TestFalling:
    def test_each_impact_has_the_restitution_of_viscoelastic_spheres(self, run):
        """Of slow ones, the loss grows as the fifth root of the speed."""
        v, e = impacts(run(SMOOTH, "contact.restitution_speed=1 m/s"))
        assert len(v) > 200 and v.max() / v.min() > 20
        slow = np.polyfit(np.log(v), np.log(1 - e), 1)[0]
        assert np.all(np.diff(e[np.argsort(v)]) <= 1e-12) and 0.15 < slow < 0.2
        assert np.abs(e[np.abs(v - 1) < 0.02] - 0.8).max() < 1e-3

    def test_each_impact_has_the_restitution_of_the_table(self, run, tmp_path):
        (tmp_path / "e.txt").write_text(ROWS)
        v, e = impacts(run(SMOOTH.replace("restitution = 0.8", "restitution_table = e.txt")))
        assert (v < 0.05).any() and ((v > 0.05) & (v < 0.3)).any() and (v > 0.3).any()
        assert np.abs(e - np.interp(v, [0.05, 0.3, 2], [0.97, 0.9, 0.5])).max() < 1e-6

    def test_one_kind_can_have_a_restitution_of_its_own(self, run, tmp_path):
        (tmp_path / "e.txt").write_text(ROWS)
        text = SMOOTH.replace("restitution = 0.8", "restitution_table = e.txt")
        path = run(text + "[contact.ball_drum]\nrestitution = 0.6\n")
        with h5py.File(path) as file:
            assert float(file["deck/contact.ball_drum/restitution"][()]) == 0.6
            assert "restitution_table" not in file["deck/contact.ball_drum"]
            assert "restitution" not in file["deck/contact"]

    def test_a_table_that_changed_is_refused_when_the_run_goes_on(self, millsim, run, write_deck, tmp_path):
        (tmp_path / "e.txt").write_text(ROWS)
        run(SMOOTH.replace("restitution = 0.8", "restitution_table = e.txt"))
        (tmp_path / "e.txt").write_text(ROWS.replace("0.9", "0.91"))
        done = millsim("--resume", "-q", "-o", "run.h5", "deck.ini")
        assert done.returncode == 2 and "a table or mesh of its deck has changed" in done.stderr

    def test_steel_falls_as_elastic_plastic_spheres_do(self, run):
        """Thornton, J. Appl. Mech. 64 (1997) 383, with a yield speed of 0.78 m/s."""
        v, e = impacts(run(SMOOTH.replace("restitution = 0.8", "restitution_table = steel"), "rotor.speed=1500 rpm"))
        at = np.array([1, 1.5, 2, 3, 5, 7, 10, 15, 20, 30])
        x = 0.78 / at
        formula = np.sqrt(6 * np.sqrt(3) / 5 * (1 - x**2 / 6)) * (x / (x + 2 * np.sqrt(1.2 - 0.2 * x**2))) ** 0.25
        assert (v > 3).sum() > 20 and (v < 1).sum() > 20
        assert np.abs(e - np.interp(v, at, np.minimum(formula, 0.97))).max() < 5.1e-4

    @pytest.mark.parametrize(
        ("rows", "why"),
        [
            ("1 0.9\n", "expected 2 to 16 rows"),
            ("1 0.9\n1 0.8\n", "e.txt:2: the speeds must ascend"),
            ("1 0.9\n2 1.1\n", "e.txt:2: a restitution is between 0 and 1"),
            ("1 0.9\n2\n", "e.txt:2: expected 2 numbers"),
            ("-1 0.9\n2 0.5\n", "e.txt:1: the speed must be 0 m/s or more"),
            ("".join(f"{k} 0.5\n" for k in range(17)), "e.txt:17: there are more than 16 rows"),
        ],
    )
    def test_a_wrong_table_is_refused_with_its_line(self, millsim, write_deck, tmp_path, rows, why):
        (tmp_path / "e.txt").write_text(rows)
        write_deck(SMOOTH.replace("restitution = 0.8", "restitution_table = e.txt"))
        done = millsim("--check", "deck.ini")
        assert done.returncode == 2 and why in done.stderr and "[contact] restitution_table" in done.stderr

    def test_a_table_and_a_number_are_refused(self, millsim, write_deck, tmp_path):
        (tmp_path / "e.txt").write_text(ROWS)
        write_deck(SMOOTH.replace("restitution = 0.8", "restitution = 0.8\nrestitution_table = e.txt"))
        done = millsim("--check", "deck.ini")
        assert done.returncode == 2 and "give only one of them" in done.stderr


class TestMaterials:
    def test_they_give_density_and_laws_and_the_summary_says_so(self, full):
        deck, said = full(STEEL)
        assert "density = 7800 kg/m^3" in deck
        assert law(deck, "ball_ball") == ("steel", 0.2, 0.35)
        assert law(deck, "ball_drum") == law(deck, "ball_blade") == ("steel", 0.092, 0.35)  # the lower values
        assert "assumed: restitution 0.97..0.474, friction 0.2, tangential 0.35" in said
        assert "steel on steel: e computed by Thornton 1997; others estimated" in said
        assert "steel on glass: the lower values of both" in said

    def test_the_summary_says_no_more_than_was_assumed(self, full):
        said = full(STEEL, "contact.restitution=0.8", "contact.friction=0.3")[1]
        assert "assumed: tangential 0.35" in said and "Thornton" not in said
        said = full(STEEL, *(f"contact.{key}=0.3" for key in ("restitution", "friction", "tangential_restitution")))[1]
        assert "assumed" not in said and "[balls] material: [contact] gives all values of the contacts" in said

    def test_a_material_without_effect_is_warned_of(self, full):
        all_given = [f"contact.{key}=0.3" for key in ("restitution", "friction", "tangential_restitution")]
        plain = SMALL.replace("length = 40 mm", "length = 40 mm\nmaterial = glass")
        assert "[drum] material: is not used: [contact] gives all values" in full(plain, *all_given)[1]
        assert "[drum] material: is not used: the balls have no 'material'" in full(plain)[1]
        assert "warning" not in full(STEEL)[1]

    def test_a_density_beside_another_material_is_warned_of(self, full):
        said = full(STEEL, "balls.density=6050 kg/m^3")[1]
        assert "[balls] density: 6050 kg/m^3 is used, not the 7800 kg/m^3 of 'steel'" in said
        assert "density:" not in full(STEEL, "balls.density=7750 kg/m^3")[1]

    def test_the_file_says_what_was_assumed(self, run):
        with h5py.File(run(STEEL)) as file:
            assert file["run/assumed/ball_drum"][()].decode() == "steel on glass: the lower values of both"
            assert float(file["deck/contact.ball_drum/friction"][()]) == 0.092
        with h5py.File(run(SMALL)) as file:
            assert "assumed" not in file["run"]

    def test_the_full_deck_gives_the_same_mill(self, full):
        deck, _ = full(STEEL)
        assert full(deck)[0] == deck

    def test_a_value_of_the_deck_comes_first(self, full):
        deck, _ = full(
            STEEL + "[contact.ball_drum]\nrestitution = 0.7\n", "contact.friction=0.4", "balls.density=8000 kg/m3"
        )
        assert "density = 8000 kg/m^3" in deck
        assert law(deck, "ball_drum") == (0.7, 0.4, 0.35) and law(deck, "ball_ball") == ("steel", 0.4, 0.35)

    def test_a_material_of_the_deck_adds_to_the_table_or_changes_it(self, full):
        bronze = (
            "[material.bronze]\ndensity = 8800 kg/m^3\nrestitution = 0.6\nfriction = 0.1\nrestitution_speed = 2 m/s\n"
        )
        deck, said = full(STEEL + bronze + "[material.steel]\nfriction = 0.25\n", "balls.material=bronze")
        assert "density = 8800 kg/m^3" in deck and law(deck, "ball_ball") == (0.6, 0.1, 0)
        assert "restitution_speed = 2 m/s" in deck and "restitution 0.6 at 2 m/s" in said
        assert law(full(STEEL + "[material.steel]\nfriction = 0.25\n")[0], "ball_ball") == ("steel", 0.25, 0.35)

    def test_a_section_changes_a_material_whatever_it_is_called(self, full):
        own = "[material.tungsten_carbide]\ndensity = 15600 kg/m^3\n"
        assert "density = 15600 kg/m^3" in full(STEEL + own, "balls.material=WC")[0]

    def test_a_speed_beside_the_table_of_a_material_is_refused(self, millsim, write_deck):
        write_deck(STEEL)
        done = millsim("--check", "-s", "contact.restitution_speed=1 m/s", "deck.ini")
        assert done.returncode == 2 and "the restitution of ball_ball is a table of all speeds" in done.stderr

    def test_what_is_between_the_surfaces_replaces_their_laws(self, full):
        deck, said = full(STEEL, "contact.between=powder")
        assert law(deck, "ball_ball") == law(deck, "ball_drum") == (0.5, 0.5, 0)
        assert "powder between: estimates" in said

    def test_parts_of_the_rotor_and_bodies_have_materials_of_their_own(self, full):
        text = STEEL.replace("speed = 600 rpm", "speed = 600 rpm\nmaterial = PTFE")
        body = "[body.pin]\nshape = sphere\nradius = 2 mm\ncentre = 0 0 25 mm\n"
        deck, _ = full(text + body + "material = agate\n")
        assert law(deck, "ball_blade") == law(deck, "ball_shaft") == (0.7, 0.08, 0.35)
        assert law(deck, "ball_pin") == ("steel", 0.15, 0.35)
        assert law(full(text + body)[0], "ball_pin") == ("steel", 0.092, 0.35)  # that of the drum

    def test_names_may_be_formulas(self, full):
        assert "density = 6050 kg/m^3" in full(STEEL, "balls.material=zro2")[0]
        assert "density = 14900 kg/m^3" in full(STEEL, "balls.material=WC")[0]
        assert "density = 3200 kg/m^3" in full(STEEL, "balls.material=si3n4")[0]
        assert "density = 7900 kg/m^3" in full(STEEL, "balls.material=stainless")[0]

    def test_an_unknown_material_gets_the_list(self, millsim, write_deck):
        write_deck(STEEL.replace("steel", "stele"))
        done = millsim("--check", "deck.ini")
        assert done.returncode == 2
        assert (
            "deck.ini:6: [balls] material: unknown material 'stele'; there are steel, tungsten_carbide" in done.stderr
        )

    def test_balls_of_two_materials_need_a_law_for_each_kind_of_contact(self, millsim, write_deck, full):
        balls = "[balls]\ncount = 20\ndiameter = 5 mm\nmaterial = steel\n"
        two = "".join(f"[balls.{m}]\ncount = 9\ndiameter = 5 mm\nmaterial = {m}\n" for m in ("steel", "PTFE"))
        text = STEEL.replace(balls, two)
        write_deck(text)
        done = millsim("--check", "deck.ini")
        assert done.returncode == 2 and "[balls.PTFE] material: contacts ball_ball have one law" in done.stderr
        laws = "restitution = 0.8\nfriction = 0.1\ntangential_restitution = 0\n"
        deck, _ = full(text.replace("[contact]\n", "[contact]\n" + laws))
        assert "density = 7800" in deck and "density = 2200" in deck

    def test_without_a_material_the_restitution_is_required(self, millsim, write_deck):
        write_deck(STEEL.replace("material = glass\n", ""))
        done = millsim("--check", "deck.ini")
        assert done.returncode == 2 and "[contact] restitution: missing" in done.stderr


POWDER = "[powder]\nmass = 1 g\ndensity = 2 g/cm^3\n"


def test_a_powder_between_contacts_of_clean_materials_is_told_with_the_mend(full):
    said = full(STEEL + POWDER)[1]
    assert "[powder] mass: the contacts are those of clean surfaces" in said
    assert "[contact] between = powder" in said


@pytest.mark.parametrize(
    "text", [STEEL.replace("[contact]\n", "[contact]\nbetween = powder\n"), SMALL], ids=["between", "given"]
)
def test_contacts_with_powder_or_given_by_the_deck_are_no_fault(full, text):
    assert "clean surfaces" not in full(text + POWDER)[1]

"""Designs: a grid has every combination, a Latin hypercube every layer once, a Sobol sequence goes on where it
ended."""

import itertools
import math

import numpy as np
import pytest
from conftest import STUDY

from milltools.base.errors import UserError
from milltools.study.plan import designs
from milltools.study.plan.study_deck import Study

RPM = math.tau / 60
RANDOM = STUDY.partition("[set]")[0] + "method = {}\nsamples = {}\nseed = {}\n[vary]\n{}"
REAL = "contact.restitution = 0.7..0.9\ncontact.friction = 0..0.4\nballs.diameter = 1..16 mm log\n"


@pytest.fixture
def study(write_study):
    def read(method, samples=64, seed=1, vary=REAL):
        return Study(write_study(RANDOM.format(method, samples, seed, vary)))

    return read


def unit_cube(study, plan):
    return np.array([[r.share(design[r.key]) for r in study.vary] for design in plan])


def test_a_grid_is_every_combination_the_last_key_fastest(write_study):
    plan = designs.plan(Study(write_study()))
    expected = itertools.product([300, 600, 900], [40, 60])
    assert [tuple(design) for design in plan] == [("rotor.speed", "balls.count")] * 6
    for design, (speed, count) in zip(plan, expected, strict=True):
        assert design == {"rotor.speed": pytest.approx(speed * RPM), "balls.count": count}


def test_a_grid_needs_single_values(write_study, tmp_path):
    path = write_study(STUDY.replace("300, 600, 900 rpm", "300..900 rpm"))
    with pytest.raises(UserError) as fault:
        designs.plan(Study(path))
    assert str(fault.value).startswith(
        f"{tmp_path}/a.study:8: [vary] rotor.speed: expected 'step' or 'in' behind the range"
    )


def test_a_grid_of_more_than_can_be_run_is_refused(write_study):
    text = "rotor.speed = 1..10000 rpm step 1 rpm\nballs.count = 1..10000\n"
    path = write_study(STUDY.partition("[vary]")[0] + "[vary]\n" + text)
    with pytest.raises(UserError, match="100000000 designs are more than 1000000"):
        designs.plan(Study(path))


def test_a_latin_hypercube_has_one_design_in_every_layer_of_every_key(study):
    own = study("lhs", 50)
    layers = np.floor(50 * unit_cube(own, designs.plan(own))).astype(int)
    assert (np.sort(layers, axis=0) == np.arange(50)[:, None]).all()


def test_a_sobol_sequence_is_balanced_in_every_half_and_quarter(study):
    own = study("sobol", 64)
    cube = unit_cube(own, designs.plan(own))
    for parts in (2, 4, 64):
        counts = [np.bincount(np.floor(parts * column).astype(int)) for column in cube.T]
        assert (np.array(counts) == 64 // parts).all()


def test_more_samples_of_a_sobol_sequence_begin_with_the_fewer(study):
    assert designs.plan(study("sobol", 100))[:30] == designs.plan(study("sobol", 30))


@pytest.mark.parametrize("method", ["lhs", "sobol"])
def test_random_designs_are_those_of_the_seed(study, method):
    assert designs.plan(study(method, seed=3)) == designs.plan(study(method, seed=3))
    assert designs.plan(study(method, seed=3)) != designs.plan(study(method, seed=4))


@pytest.mark.parametrize("method", ["lhs", "sobol"])
def test_random_designs_keep_to_steps_whole_numbers_and_words(study, method):
    vary = "rotor.speed = 300..900 rpm step 300 rpm\nballs.count = 3..9\ndrum.profile = circle, wavy\n"
    plan = designs.plan(study(method, 200, vary=vary))
    found = [{design[key] for design in plan} for key in plan[0]]
    assert sorted(found[0]) == pytest.approx([300 * RPM, 600 * RPM, 900 * RPM])
    assert found[1:] == [set(range(3, 10)), {"circle", "wavy"}]
    assert all(isinstance(count, int) for count in found[1])


def test_equal_designs_are_run_once(study):
    plan = designs.plan(study("lhs", 200, vary="balls.count = 1..5\n"))
    assert sorted(design["balls.count"] for design in plan) == [1, 2, 3, 4, 5]


def test_all_designs_are_run_with_one_seed_before_the_next(write_study):
    own = Study(write_study(), ["study.replicates=2"])
    jobs = list(designs.jobs(own, designs.plan(own)))
    assert [(job["replicate"], job["design"], job["seed"]) for job in jobs] == [
        (replicate, design, 1 + replicate) for replicate in range(2) for design in range(6)
    ]
    assert len({job["id"] for job in jobs}) == 12

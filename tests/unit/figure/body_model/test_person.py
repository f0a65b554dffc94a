"""People by measures: what is told is reached, the rest is as real people have it."""

import warnings

import numpy as np
import pytest

import vistel.figure
from vistel.figure.avatar.check import check_avatar
from vistel.figure.body_model.fit import DENSITY, statistics, volume
from vistel.figure.body_model.measures import COLUMNS, measures
from vistel.figure.body_model.model import body_model
from vistel.figure.body_model.person import Person, PersonWarning, checked, drawn, fit
from vistel.figure.figure import Figure
from vistel.figure.posture.standard import standard_postures


@pytest.mark.parametrize(("sex", "height", "weight"), [("male", 1.80, 80.0), ("female", 1.62, 58.0), ("male", 1.65, 85.0)])
def test_height_and_weight_are_hit(sex: str, height: float, weight: float) -> None:
    found = fit(Person(sex, 35.0, height, weight, face_seed=4))
    p = found.shape.points[: body_model().body]
    assert np.ptp(p[:, 1]) == pytest.approx(height, abs=0.001)
    assert volume(p, body_model().closed) * DENSITY == pytest.approx(weight, abs=0.5)


def test_children_are_made_to_their_height() -> None:
    found = fit(Person("male", 8.0, 1.28, 26.0))
    assert found.shape.stature == pytest.approx(1.28, abs=0.001)


def test_measures_that_are_told_are_hit() -> None:
    told = {"waist girth": 0.95, "chest girth": 1.02, "upper arm length": 0.36}
    found = fit(Person("male", 40.0, 1.76, 84.0, measures=told))
    reached = measures(body_model(), found.shape)
    assert {name: reached[name] for name in told} == pytest.approx(told, abs=0.008)


def test_random_people_measure_what_people_measure() -> None:
    outside: list[str] = []
    for sex in ("female", "male"):
        for seed in range(100, 106):
            found = measures(body_model(), fit(drawn(seed, sex)).shape)
            table = statistics()[sex]
            assert set(found) == set(COLUMNS)
            outside += [
                f"{sex} {seed}: {name} {value:.3f}"
                for name, value in found.items()
                if not table[name]["percentiles"][0] <= value <= table[name]["percentiles"][-1]
            ]
    # One in two hundred: of real people, one in fifty is.
    assert len(outside) <= 0.005 * 12 * len(COLUMNS), outside


def test_the_same_words_make_the_same_person_and_other_seeds_others() -> None:
    a, b, c = (fit(Person(face_seed=seed)).shape.points for seed in (1, 1, 2))
    assert np.array_equal(a, b)
    assert np.abs(a - c).max() > 0.001


def test_what_is_beyond_the_model_is_brought_to_its_bounds_and_said() -> None:
    with pytest.warns(PersonWarning, match=r"height: 3 is beyond what the model covers, 0\.6 to 2\.2; 2\.2 taken"):
        assert checked(Person(height=3.0)).height == 2.2
    with pytest.warns(PersonWarning, match="weight: 200 kg at 1.60 m is beyond the model"):
        fit(Person(height=1.6, weight=200.0))


def test_words_that_are_not_known_are_refused_in_one_line() -> None:
    with pytest.raises(ValueError, match="sex: expected one of female, male, got 'man'"):
        vistel.figure.person(sex="man")
    with pytest.raises(ValueError, match="no measure 'waist'; expected one of stature, span"):
        vistel.figure.person(measures={"waist": 0.9})
    with pytest.raises(ValueError, match="origin: expected shares of"):
        vistel.figure.person(origin=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="height: expected a number"):
        vistel.figure.person(height=float("nan"))


def test_a_person_is_a_figure_that_is_drawn_posed_and_moves_its_face() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        avatar = vistel.figure.person(sex="male", height=1.75, weight=76.0, name="ada").avatar
    check_avatar(avatar, "ada")
    assert avatar.name == "ada"
    assert avatar.skeleton.height == pytest.approx(1.75, abs=0.01)
    assert len(avatar.coarser) == 2 and len(avatar.eyeballs) == 2 and len(avatar.mesh.targets) == 52
    posed = Figure(avatar).pose(standard_postures()["sitting"])
    assert np.isfinite(posed.vertices).all()
    assert np.ptp(posed.vertices[:, 1]) < 1.5

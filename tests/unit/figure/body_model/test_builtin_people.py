"""The ten built-in people."""

import pytest

from vistel.figure.body_model.builtin_people import PEOPLE, builtin_person
from vistel.figure.body_model.person import checked, colours_of
from vistel.figure.making.report import inspect_avatar
from vistel.figure.people.builtin import builtin_avatar


def test_they_are_ten_of_all_ages_and_the_model_covers_them() -> None:
    assert list(PEOPLE)[:3] == ["aiko", "ben", "carla"] and len(PEOPLE) == 10
    ages = sorted(p.age for p in PEOPLE.values())
    assert ages[0] < 14.0 and ages[-1] > 70.0
    assert {p.sex for p in PEOPLE.values()} == {"female", "male"}
    assert len({p.face_seed for p in PEOPLE.values()}) == 10
    for person in PEOPLE.values():
        assert checked(person) == person


def test_the_old_are_grey_and_people_of_dark_origins_have_dark_hair() -> None:
    assert colours_of(PEOPLE["grace"]).grey > colours_of(PEOPLE["farah"]).grey >= colours_of(PEOPLE["carla"]).grey == 0.0
    assert all(sum(colours_of(PEOPLE[name]).hair) < 120.0 for name in ("aiko", "ben", "hiro"))


def test_a_name_that_is_not_known_is_refused_in_one_line() -> None:
    with pytest.raises(ValueError, match="no built-in person 'zoe'; expected one of aiko, ben"):
        builtin_person("zoe")


@pytest.mark.slow
@pytest.mark.parametrize(("who", "height"), [("aiko", 1.60), ("ben", 1.60), ("carla", 1.90)])
def test_no_primitive_of_a_built_in_person_is_called_a_bad_fit(who: str, height: float) -> None:
    """Their fingers have the vertices that stand out most."""
    facts, _ = inspect_avatar(builtin_avatar(f"builtin:person={who}", name=who, height=height))
    assert facts["primitives_that_fit_badly"] == []

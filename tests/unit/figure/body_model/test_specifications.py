"""People of the body model by specification: what words mean, and what is refused."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from vistel.figure.avatar.proportions import Proportions
from vistel.figure.body_model.builtin_people import PEOPLE
from vistel.figure.body_model.person import Person
from vistel.figure.people.builtin import builtin_avatar, builtin_proportions, described, is_made


def person(spec: str, name: str = "zoe", height: float = 1.7) -> Person:
    return described(spec, name, height)


def test_without_words_a_name_is_a_person_always_the_same_and_a_known_name_that_person() -> None:
    assert person("builtin", "zoe") == person("builtin", "zoe") != person("builtin", "yann")
    assert person("builtin", "ben", 1.82) == person("builtin:person=ben", "somebody", 1.82) == PEOPLE["ben"]


def test_words_are_taken_and_the_rest_stays_as_drawn() -> None:
    drawn, told = person("builtin"), person("builtin:sex=male,age=40,weight=85,skin=0.6,hair=bob,beard=none,top=sweater,face=7")
    assert (told.sex, told.age, told.weight, told.skin, told.hair, told.beard, told.face_seed) == (
        "male",
        40,
        85,
        0.6,
        "bob",
        "none",
        7,
    )
    assert told.outfit is not None
    assert told.outfit.top == "sweater"
    assert person("builtin:skin=0.6,muscle=0.5").age == drawn.age
    assert person("builtin:person=ben,glasses=round").glasses == "round"


def test_a_known_person_of_another_height_is_as_heavy_for_it() -> None:
    usual = PEOPLE["ben"]
    assert usual.weight is not None
    assert usual.height is not None
    for tall in (person("builtin:person=ben", height=1.92), person("builtin", "ben", 1.92)):
        assert tall.weight is not None
        assert tall.weight / 1.92**2 == pytest.approx(usual.weight / usual.height**2)


def test_with_a_seed_a_person_does_not_depend_on_the_name() -> None:
    assert person("builtin:seed=3", "zoe") == person("builtin:seed=3", "yann") != person("builtin:seed=4", "zoe")
    assert person("builtin:seed=3,hair=bun").hair == "bun"


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("builtin:person=bob", "no built-in person 'bob'; expected one of aiko"),
        ("builtin:age=200", "age: expected a number from 3 to 90, got '200'"),
        ("builtin:age=nan", "age: expected a number"),
        ("builtin:weight=heavy", "weight: expected a number"),
        ("builtin:sex=robot", "sex: expected one of female, male"),
        ("builtin:face=1,hair=mohawk", "hair: expected one of shaved"),
        ("builtin:face=1,beard=long", "beard: expected one of none"),
        ("builtin:face=1,top=coat", "top: expected one of t-shirt"),
        ("builtin:face=1,glasses=monocle", "glasses: expected one of none, round"),
        ("builtin:face=1,pattern=dots", "pattern: expected one of plain"),
        ("builtin:face=1,hat=3", "got 'hat=3'"),
        ("builtin:seed=-1", "seed: expected a number from 0"),
        ("builtin:seed=3,build=1.2", "got 'build=1.2'"),
        ("builtin:face", "got 'face'"),
    ],
)
def test_a_wrong_word_is_refused_in_one_line_that_says_what_was_expected(spec: str, said: str) -> None:
    with pytest.raises(ValueError, match=f"^avatar '{spec}': ") as fault:
        described(spec, "zoe", 1.7)
    assert said in str(fault.value)
    assert "\n" not in str(fault.value)


def test_limbs_are_known_before_the_avatar_is_made_and_are_its_own(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        limbs = builtin_proportions("builtin:person=aiko", name="aiko", height=1.64, cache=tmp_path)
    assert limbs is not None
    assert not is_made("builtin:person=aiko", name="aiko", height=1.64, cache=tmp_path)
    avatar = builtin_avatar("builtin:person=aiko", name="aiko", height=1.64, cache=tmp_path)
    assert limbs == Proportions.of(avatar.skeleton, avatar.body)
    assert builtin_proportions("builtin:person=aiko", name="aiko", height=1.64, cache=tmp_path) == limbs
    (kept,) = tmp_path.glob("limbs-*.npz")
    kept.write_bytes(b"no such file")
    again = builtin_proportions("builtin:person=aiko", name="aiko", height=1.64, cache=tmp_path)
    assert again is not None
    np.testing.assert_array_equal(again.arrays[0], limbs.arrays[0])

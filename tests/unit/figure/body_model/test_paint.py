"""The texture of people and what it is like."""

from dataclasses import replace
from functools import cache

import numpy as np

from vistel.arrays import U8
from vistel.figure.avatar.patch import Patch, fault_of
from vistel.figure.body_model.lid_rims import lid_rims
from vistel.figure.body_model.model import body_model
from vistel.figure.body_model.paint import Colours, paint, tone
from vistel.figure.body_model.texels import mask


@cache
def painted(colours: Colours) -> tuple[U8, tuple[Patch, ...]]:
    return paint(body_model(), colours)


def _mean(picture: np.ndarray, name: str, least: float = 0.9) -> np.ndarray:
    return picture[mask(body_model(), name) > least].mean(axis=0)


def test_the_same_colours_give_the_same_texture_with_patches_that_files_can_keep() -> None:
    (one, patches), (two, _) = paint(body_model(), Colours()), paint(body_model(), Colours())
    assert np.array_equal(one, two)
    assert fault_of(patches, 4096) == ""
    assert [p.relief for p in patches] == [True, False], "only what lies near is drawn with its pores"
    assert patches[-1].opacity is not None, "lashes are seen through"


def test_palms_of_dark_skin_are_lighter_and_lips_of_light_skin_redder() -> None:
    dark, light = (painted(Colours(skin=skin))[0] for skin in (0.9, 0.1))
    assert _mean(dark, "palms").mean() > 1.3 * tone(0.9).mean()
    lips, skin = _mean(light, "lips"), tone(0.1)
    assert lips[0] / lips[1] > 1.1 * skin[0] / skin[1]


def test_age_shows_in_folds_and_grey_hair_in_brows() -> None:
    young = Colours(hair=(30.0, 22.0, 18.0))
    old = replace(young, age=80.0, hair=(150.0, 148.0, 146.0), grey=0.9)
    (a, of_young), (b, of_old) = painted(young), painted(old)
    assert _mean(b, "brows", 0.6).mean() > _mean(a, "brows", 0.6).mean() + 5.0
    folds = mask(body_model(), "folds") > 0.2
    uneven = [
        float(np.abs(p[0].normal[folds][:, :2].astype(int) - 128).mean()) for p in (of_young, of_old) if p[0].normal is not None
    ]
    assert uneven[1] > 1.5 * uneven[0]


def test_tears_stand_on_the_rims_of_both_eyes_and_shine() -> None:
    model = body_model()
    rims, (_, patches) = lid_rims(model), painted(Colours())
    half = len(rims.wet) // 2
    assert all((part > 0.5).sum() > 20 for shape in (rims.rim, rims.wet, rims.duct) for part in (shape[:half], shape[half:]))
    assert (rims.rim[rims.wet > 0.5] > 0.5).all(), "tears stand where a lid meets the eyeball"
    finish = patches[0].finish
    assert finish is not None
    rough, wet, skin = finish[..., 1], rims.wet[::2, ::2] > 0.9, mask(model, "flush")[::2, ::2] > 0.5
    assert rough[wet].mean() < 0.5 * rough[skin].mean()


def test_a_mouth_is_lighter_in_front_than_in_its_depth() -> None:
    picture, _ = painted(Colours())
    u0, v0, u1, v1 = body_model().boxes["mouth"]
    rows = [round((1.0 - (v0 + share * (v1 - v0))) * picture.shape[0]) for share in (0.15, 0.95)]
    front, deep = (picture[row, round(0.5 * (u0 + u1 + 0.03) * picture.shape[1])].mean() for row in rows)
    assert front > 1.8 * deep > 20.0

"""Looks: what a file may say, what is wrong with others, and the technique that one makes."""

from pathlib import Path

import pytest

from realtime.code import drawing_code, looks_of
from realtime.looks import Look, components, look_of, look_text, read_look, technique_of, values_for, with_looks
from realtime.own import load_own
from realtime.techniques import technique
from scenes.errors import InputError

GOOD = """\
technique = "layered.talk"
name = "mine.suit"
summary = "a suit for tests"

[sliders]
layer1_diffuse = 0.5
layer2_alpha = [0.1, 0.0, 0.0, 0.9]
"""


def test_a_look_sets_sliders_and_leaves_the_others() -> None:
    look = read_look(GOOD, "suit.toml")
    base = technique("layered.talk")
    made = technique_of(look, base, "suit.toml").settings({})
    assert made["layer1_diffuse"] == 0.5
    assert [made[name] for name in components("layer2_alpha")] == [0.1, 0.0, 0.0, 0.9]
    assert made["layer2_strength_1"] == base.settings({})["layer2_strength_1"]


def test_a_look_is_chosen_by_its_name_and_overridden_by_what_is_given() -> None:
    subject = technique("layered.talk")
    by_eye, plastic = subject.settings({}), subject.settings({"look": "plastic"})
    assert by_eye["layer1_diffuse"] != plastic["layer1_diffuse"]
    assert subject.settings({"look": "plastic", "layer1_diffuse": 0.123})["layer1_diffuse"] == 0.123
    assert by_eye["damping"] == plastic["damping"]


def test_what_is_written_is_read_again() -> None:
    subject = technique("layered.talk")
    settings = subject.settings({"look": "clearcoat", "layer2_alpha_texture3": 0.25})
    look = look_of(subject, "mine.copy", "a copy of another", settings)
    assert read_look(look_text(look), "copy.toml") == look
    assert technique_of(look, subject, "copy.toml").settings({}) == {
        name: value for name, value in settings.items() if name != "look"
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("technique =", "technik =", r"suit\.toml:1: technik: is an unknown key. A look has technique, name, summary"),
        ('name = "mine.suit"\n', "", r"suit\.toml:1: name: is missing"),
        ("0.5", '"half"', r"suit\.toml:6: sliders\.layer1_diffuse: found 'half'; allowed is a number, or 4"),
        ("0.5", "nan", r"suit\.toml:6: sliders\.layer1_diffuse: found"),
        ("[0.1, 0.0, 0.0, 0.9]", "[0.1, 0.9]", r"suit\.toml:7: sliders\.layer2_alpha: found \[0\.1, 0\.9\]; allowed"),
        ("a suit for tests", "none", r"suit\.toml:3: summary: found 'none'"),
        ("layer1_diffuse = ", "layer1_diffuse ", r"suit\.toml: the look is no valid TOML: .*line 6.*\. Mend it\."),
        ("layer1_diffuse", "layer1_difuse", r"Unknown slider of layered\.talk 'layer1_difuse'.*Did you mean 'layer1_d"),
        ("layer2_alpha", "layer2_alpha_texture1", r"Unknown slider of layered\.talk 'layer2_alpha_texture1'"),
        ("0.5", "-0.5", r"suit\.toml: Setting 'layer1_diffuse' of 'layered\.talk' is -0\.5; 0 to 10000 is allowed"),
        ("layered.talk", "layered.tlk", r"Unknown technique that ships 'layered\.tlk'.*Did you mean 'layered\.talk'"),
        ("layered.talk", "layered.ggx", r"suit\.toml: 'layered\.ggx' has no sliders, which a look sets"),
        ("mine.suit", "mine suit", r"'mine suit' is no name for a technique"),
        ("mine.suit", "layered.talk", r"'layered\.talk' is already the name of a technique that ships"),
    ],
)
@pytest.mark.usefixtures("techniques_forgotten")
def test_what_is_wrong_with_a_look_is_said_with_its_place(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "suit.toml"
    path.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_own(path)


@pytest.mark.usefixtures("techniques_forgotten")
def test_a_look_of_ones_own_is_a_technique(tmp_path: Path) -> None:
    path = tmp_path / "suit.toml"
    path.write_text(GOOD, encoding="utf-8")
    assert load_own(path) == ("mine.suit",)
    made = technique("mine.suit")
    assert (made.approximates, made.look_of) == ("layered_radiance", "layered.talk")
    assert [parameter.name for parameter in made.parameters] == ["damping", "spread"]
    assert look_of(made, "mine.other", "another one", made.settings({})).technique == "layered.talk"


def test_a_shipped_look_of_another_technique_is_refused() -> None:
    look = Look(technique="layered.ggx", name="x", summary="of another technique", sliders={})
    with pytest.raises(InputError, match=r"one of 'layered\.ggx', and not of 'layered\.talk'"):
        values_for(technique("layered.talk"), look, "x.toml")


def test_a_changed_look_is_another_drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A finished check would else be found again that was drawn with other numbers."""
    shipped = looks_of("layered.talk")
    assert [path.stem for path in shipped] == ["blend", "by_eye", "clearcoat", "plastic"]
    assert looks_of("indirect.talk") == []
    before = drawing_code("layered.talk")
    copies = [tmp_path / path.name for path in shipped]
    for path, copy in zip(shipped, copies, strict=True):
        copy.write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    copies[0].write_text(GOOD, encoding="utf-8")
    monkeypatch.setattr("realtime.code.looks_of", lambda name: copies)
    drawing_code.cache_clear()
    assert drawing_code("layered.talk") != before
    drawing_code.cache_clear()


def test_shipped_looks_go_by_the_names_of_their_files() -> None:
    bare = technique("layered.talk")
    files = looks_of("layered.talk")
    assert list(with_looks(bare, files).looks) == [path.stem for path in files]
    assert {read_look(path.read_text(encoding="utf-8"), path.name).name for path in files} == set(bare.looks)

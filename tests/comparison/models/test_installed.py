"""Models of other packages that cannot be had or declare bad settings (tests/cli has what bad runs cost)."""

import pytest

from comparison.models import EngineError, declared_settings, find, load

THING = "number = 3\ndef f(scene): pass\n"


@pytest.mark.parametrize(
    ("source", "points", "message"),
    [
        (THING, {"mine": "nowhere:simulate"}, "cannot be imported from 'nowhere:simulate': ModuleNotFound"),
        (THING, {"mine": "thing:absent"}, "from 'thing:absent': AttributeError: module 'thing'"),
        (THING, {"mine": "thing:number"}, "'mine': 'thing:number' is not a function but a int"),
        (THING, {"yours": "thing:f"}, "model 'mine' is not known; available: reference, exudyn, yours"),
        ("print('hello')\nraise ValueError('no\\nlicence')", {"mine": "thing:f"}, "ValueError: no licence"),
        ("import sys; sys.exit(3)", {"mine": "thing:f"}, "cannot be imported from 'thing:f': SystemExit"),
    ],
)
def test_a_model_that_cannot_be_had_is_one_line(install, source, points, message, capfd):
    install("thing", source, points)
    with pytest.raises(EngineError) as refused:
        load("mine")
    assert (message in str(refused.value), "\n" in str(refused.value)) == (True, False)
    assert capfd.readouterr().out == ""


def test_two_packages_with_a_model_of_one_name_are_refused(install):
    install("thing", THING, {"reference": "thing:f"})
    with pytest.raises(EngineError, match="twice: reference_model:simulate and thing:f"):
        find("reference")


@pytest.mark.parametrize(
    ("settings", "rule"),
    [
        ("3", "settings must be a mapping, not int"),
        ("{'order': [4]}", r"settings\['order'\] = \[4\] must be a string"),
        ("{'step': float('nan')}", r"settings\['step'\] = nan must be"),
    ],
)
def test_settings_that_are_none_are_refused(install, settings, rule):
    install("thing", f"def f(scene): pass\nf.settings = {settings}\n", {"mine": "thing:f"})
    with pytest.raises(EngineError, match=rule):
        declared_settings("mine")

"""Models of other packages that cannot be had or declare bad settings (tests/cli has what bad runs cost)."""

import pytest

from comparison.models import EngineError, declared_settings, find, load


@pytest.mark.parametrize(
    ("source", "points", "message"),
    [
        ("f = 3", {"mine": "thing:f"}, "'mine': 'thing:f' is not a function but a int"),
        ("", {"mine": "thing:f"}, "from 'thing:f': AttributeError: module 'thing'"),
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
    install("thing", "", {"reference": "thing:f"})
    with pytest.raises(EngineError, match="twice: reference_model:simulate and thing:f"):
        find("reference")


@pytest.mark.parametrize("settings", ["3", "{'step': float('nan')}"])
def test_settings_that_are_none_are_refused(install, settings):
    install("thing", f"def f(scene): pass\nf.settings = {settings}\n", {"mine": "thing:f"})
    with pytest.raises(EngineError, match=r"'mine': settings.* must be"):
        declared_settings("mine")

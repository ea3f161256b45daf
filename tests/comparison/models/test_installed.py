"""Models of other packages that cannot be had or declare bad settings (tests/cli has what bad runs cost)."""

import pytest

from comparison.models import EngineError, declared_settings, find, load


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ({"mine": "nowhere:simulate"}, "'mine' cannot be imported from 'nowhere:simulate': ModuleNotFound"),
        ({"mine": "thing:absent"}, "from 'thing:absent': AttributeError: module 'thing'"),
        ({"mine": "thing:number"}, "'mine': 'thing:number' is not a function but a int"),
        ({"mine": "thing:f", "reference": "thing:f"}, "twice: reference_model:simulate and thing:f"),
        ({"yours": "thing:f"}, "model 'mine' is not known; available: reference, exudyn, yours"),
    ],
)
def test_a_model_that_cannot_be_had_is_one_line(install, points, message):
    install("thing", "number = 3\ndef f(scene): pass\n", points)
    with pytest.raises(EngineError) as refused:
        find("reference") if len(points) > 1 else load("mine")
    assert (message in str(refused.value), "\n" in str(refused.value)) == (True, False)


@pytest.mark.parametrize("fault", ["raise ValueError('no\\nlicence')", "import sys; sys.exit(3)", "1 +"])
def test_a_package_that_cannot_be_imported_is_one_line(install, fault, capfd):
    install("thing", f"print('hello')\n{fault}", {"mine": "thing:f"})
    with pytest.raises(EngineError, match="model 'mine' cannot be imported from 'thing:f': ") as no:
        load("mine")
    assert "\n" not in str(no.value)
    assert capfd.readouterr().out == ""


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
    assert declared_settings("reference") == {}

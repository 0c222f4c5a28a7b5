"""Every option that is described, as `fathom options --json` says: Python's keywords accept the same values as the program."""

import json
import math

import numpy
import pytest

import fathom

from conftest import HEIGHT, WIDTH

def required(operation, picture):
    """What a call needs, whatever its options."""
    made = {"radius": 0.3} if operation["name"] == "ssao" else {}  # which other cameras have
    for option in operation["options"]:
        if option["default"] is None or option["kind"] == "lens":
            made[option["name"]] = {"picture": picture, "lens": (40, 180)}.get(option["kind"], 0.25)
    return made


def values(option):
    """Pairs of a value and whether it will do."""
    if option["kind"] == "choice":
        return [(choice, True) for choice in option["choices"]] + [("no such word", False)]
    if option["kind"] in ("flag", "result"):
        return [(True, True), (False, True)]
    if "values" in option:
        return [(int(value), True) for value in option["values"]] + [(int(max(option["values"])) + 1, False)]
    if option["kind"] == "number":
        least, most = option["least"], option["most"]  # a word where there is none
        step = 1 if option["whole"] else 0.25
        made = [(math.nan, False)] if not option["whole"] else []
        if isinstance(least, (int, float)):
            made += [(least - step, False), (least, not option["least_excluded"]), (least + step, True)]
        if isinstance(most, (int, float)):
            made += [(most + step, False), (most, not option["most_excluded"])]
        made += [(option["beside"], True)] if "beside" in option else []
        return [(int(v), fits) if option["whole"] else (v, fits) for v, fits in made]
    return []


def test_values_within_their_ranges_and_beyond(program, metres, keys):
    camera, picture = fathom.Camera(**keys), numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32)
    depth = metres.astype(numpy.float32)
    checked = 0
    for operation in json.loads(program("options", "--json").stdout)["operations"]:
        for option in operation["options"]:
            for value, fits in values(option):
                said = ""
                try:
                    given = required(operation, picture) | dict.fromkeys(option["needs"], 0.1) | {option["name"]: value}
                    getattr(fathom, operation["name"])(depth, camera, **given)
                except ValueError as error:
                    said = str(error)
                own = said.startswith(f"{option['name']} = ") and (" must " in said or " is unknown" in said)
                assert own == (not fits), (operation["name"], option["name"], value, said)
                checked += 1
    assert checked > 100
    print(f"{checked} values")


def test_options_are_those_of_the_program(program):
    described = json.loads(program("options", "--json").stdout)["operations"]
    for operation in described:
        for option in operation["options"]:
            del option["program"]
    assert fathom.options() == described


def test_what_needs_another_option_is_refused_without_it(metres, keys):
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    picture = numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32)
    tried = 0
    for operation in fathom.options():
        for option in operation["options"]:
            for other in option["needs"]:
                value = {"number": 1.0, "three numbers": (0.0, 1.0, 0.0)}[option["kind"]]
                with pytest.raises(ValueError, match=f"{option['name']}: is of no use without {other}"):
                    given = required(operation, picture) | {option["name"]: value}
                    getattr(fathom, operation["name"])(depth, camera, **given)
                tried += 1
    assert tried >= 2


def test_an_option_that_is_described_is_a_keyword_and_no_other(program):
    import inspect

    for operation in json.loads(program("options", "--json").stdout)["operations"]:
        signature = inspect.signature(getattr(fathom, operation["name"]))
        assert {option["name"] for option in operation["options"]} <= set(signature.parameters)

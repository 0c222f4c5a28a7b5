"""Every option that is described, as `fathom options --json` says: Python's keywords accept the same values as the program."""

import inspect
import json
import keyword
import math

import numpy

import fathom

from conftest import HEIGHT, WIDTH

LENS = {"focus": 5, "f_stop": 2, "focal_length_mm": 0.01, "sensor_mm": 36}


def python_name(name):
    return name + "_" * keyword.iskeyword(name)


def required(operation, picture):
    """What a call needs, whatever its options."""
    made = {"radius": 0.3} if operation["name"] == "ssao" else {}  # which other cameras have
    for option in operation["options"]:
        if option["required"]:
            made[option["name"]] = picture if option["kind"] == "picture" else 0.25
    return made | (LENS if operation["name"].startswith("dof") else {})


def beside(operation, option, given):
    """What a call needs with this option, without what the option excludes."""
    made = {name: value for name, value in required(operation, given["picture"]).items() if name not in option["excludes"]}
    for need in option["needs"][:1]:
        name, _, value = need.partition("=")
        other = next(each for each in operation["options"] if each["name"] == name)
        if name == "relative":  # instead of a lens
            made = {each: own for each, own in made.items() if each not in LENS}
        made[name] = value or given.get(other["kind"], (other["choices"] or [0.1])[0])
    return made


THREE = (0.25, 0.5, 0.75)
FITTING = {"flag": True, "result": True, "three numbers": THREE, "color": THREE, "direction": THREE, "fractions": (0.25, 0.5)}
FITTING |= {"ends": (0.25, 2), "lens": (40, 180), "pixel": (2, 1), "ray": (2, 1, math.inf), "region": (1.0, 1, 4, 3)}
WRONG = {"choice": "no such word", "three numbers": (math.nan, 0, 0), "color": (0, math.inf, 0), "direction": (0, 0, 0)}
WRONG |= {"fractions": (0.5, 0.25), "ends": (1, 1), "lens": (-1, 180), "ray": (2, 1, 0.0), "region": (0, 0, 0, 2)}


def values(option):
    """One that fits, and is not the default, and one that does not. None where there is no such."""
    kind = option["kind"]
    fitting, wrong = [FITTING.get(kind)], WRONG.get(kind)
    if kind == "choice":
        fitting = option["choices"]
    elif "values" in option:
        fitting, wrong = option["values"], min(option["values"]) - 1
    elif kind == "number":
        step = 1 if option["whole"] else 0.25
        least = option["least"] if isinstance(option["least"], (int, float)) else 1  # a word where there is none
        fitting, wrong = [least + step, least + 2 * step], math.nan if option["least"] == "-inf" else least - 2 * step
    return next(value for value in fitting if value is None or value != option["default"]), wrong


def refusal(operation, depth, camera, given):
    try:
        getattr(fathom, operation["name"])(depth, camera, **given)
    except ValueError as error:
        return str(error)
    return ""


def test_a_value_that_fits_and_one_that_does_not(program, metres, keys):
    """tests/test_cli_options.cpp has every end of every range, which are checked in one place."""
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    images = {"picture": numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32), "depth": depth, "result": True}
    images["directions"] = numpy.full((HEIGHT, WIDTH, 3), 3**-0.5, numpy.float32)
    checked = 0
    for operation in json.loads(program("options", "--json").stdout)["operations"]:
        for option in operation["options"]:
            name = python_name(option["name"])
            for value, fits in zip(values(option), (True, False)):
                if value is None:
                    continue
                said = refusal(operation, depth, camera, beside(operation, option, images) | {name: value})
                assert (said.startswith(f"{name} = ") and " must be " in said) == (not fits), (operation["name"], name, value, said)
                checked += 1
    assert checked > 100
    print(f"{checked} values")


def test_options_are_those_of_the_program(program):
    described = json.loads(program("options", "--json").stdout)["operations"]
    for operation in described:
        for option in operation["options"]:
            del option["program"], option["program_takes"]
            option["name"] = python_name(option["name"])
    assert fathom.options() == described
    kinds = {"number": (int, float, str), "choice": str, "flag": bool, "result": bool}  # a str is infinity
    for option in (option for operation in described for option in operation["options"]):
        default = option["default"]
        assert default is None or (isinstance(default, kinds.get(option["kind"], list)) and not option["required"])
        assert option["required"] or option["default_words"]


def test_an_option_that_is_described_is_a_keyword_and_no_other(program):
    common = {"depth", "camera", "ignore", "edges", "storage", "out", "device"}
    for operation in fathom.options():
        described = {option["name"] for option in operation["options"]}
        hook = {"color"} if operation["name"] == "dof_masks" else set()  # which gives the results their size
        hook |= {"supersampled"} if operation["name"] in ("ssao", "dof", "fog") else set()
        assert set(inspect.signature(getattr(fathom, operation["name"])).parameters) == described | common | hook


def test_a_call_with_all_defaults_is_one_without_them(metres, keys):
    """As the panel of another program makes it."""
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    picture = numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32)
    for operation in fathom.options():
        defaults = {option["name"]: option["default"] for option in operation["options"] if option["default"] is not None}
        call, needed = getattr(fathom, operation["name"]), required(operation, picture)
        if infinite := [name for name, value in defaults.items() if value == "inf" and name != "background"]:
            defaults |= dict.fromkeys(infinite, math.inf)
        for given in (defaults, dict(reversed(defaults.items()))):
            made, plain = call(depth, camera, **needed, **given), call(depth, camera, **needed)
            for one, other in zip(made, plain):
                numpy.testing.assert_array_equal(one, other)


def test_an_option_at_its_default_stands_beside_anything(metres, keys):
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    picture = numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32)
    numpy.testing.assert_array_equal(
        fathom.dof(depth, camera, picture, circle=(3, 1), blades=0, ratio=2),
        fathom.dof(depth, camera, picture, circle=(3, 1), ratio=2),
    )
    for given in ({"max_error": 0.1, "quality": "balanced"}, {"quality": "balanced", "max_error": 0.1}):
        numpy.testing.assert_array_equal(
            fathom.ssao(depth, camera, 0.3, **given), fathom.ssao(depth, camera, 0.3, max_error=0.1)
        )
    with_flag = {"operation": "dof_masks", "tile_px": 8, "tile_min_coc": False}
    for name, given in (("fog", {"density": 0.1, "up": (0, 0, 1), "height_falloff": 0}), (with_flag.pop("operation"), with_flag)):
        its = next(each for each in fathom.options() if each["name"] == name)
        assert "is of no use without" in refusal(its, depth, camera, required(its, picture) | given), name

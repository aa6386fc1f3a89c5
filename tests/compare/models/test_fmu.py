"""Units that an FMU declares, and its steady state, whatever its scale of time."""

import re
from pathlib import Path
from zipfile import ZipFile

import pytest

import compare
from scenes import load
from scenes.errors import SceneError

fmpy = pytest.importorskip("fmpy")
builder = pytest.importorskip("pythonfmu.builder")

SOURCE = """from math import exp, sin
from os import abort

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Lump(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.top = TOP
        self.show(300.0)
        self.register_variable(Real("top", causality=Fmi2Causality.input))
        for name in ("tip", "heat_out"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def show(self, T):
        self.tip, self.heat_out = TIP, HEAT

    def do_step(self, current_time, step_size):
        t, x = current_time + step_size, self.top
        top = KELVIN
        self.show(COURSE)
        return STEPS
"""
UNITS = """<UnitDefinitions>
<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
<Unit name="degF"><BaseUnit K="1" factor="0.5555555555555556" offset="255.37222222222223"/></Unit>
<Unit name="uW"><BaseUnit kg="1" m="2" s="-3" factor="1e-6"/></Unit>
<Unit name="lm"><BaseUnit cd="1"/></Unit>
</UnitDefinitions>
<TypeDefinitions><SimpleType name="Celsius"><Real unit="degC"/></SimpleType>
<SimpleType name="Rise"><Real unit="degC" relativeQuantity="1"/></SimpleType></TypeDefinitions>
<DefaultExperiment startTime="10" stopTime="20"/>
<ModelVariables>"""
"""The experiment is no part of a scene, whose times count from 0."""


def build(
    folder: Path, course: str = "top + (300 - top)*exp(-t/1.6e-4)", tip: tuple[str, str, str] = ("", "T", "x"),
    heat: tuple[str, str] = ("", "-2e-5*(T - 300)"), steps: str = "True",
) -> str:  # fmt: skip
    """Return the path of an FMU whose temperature (K) follows a ``course``, from 300 K.

    ``tip`` and ``heat`` are attributes of the outputs and their values, and the first the conversion of the input
    "top", 400 K by itself, back to kelvins. ``steps`` says whether a step succeeds.
    """
    start = str(eval(tip[1], {"T": 400.0}))
    source = SOURCE.replace("TOP", start).replace("TIP", tip[1]).replace("HEAT", heat[1]).replace("STEPS", steps)
    module = folder / f"{folder.name}.py"  # A process imports a name once.
    module.write_text(source.replace("KELVIN", tip[2]).replace("COURSE", course), encoding="utf-8")
    builder.FmuBuilder.build_FMU(module, dest=folder)
    with ZipFile(folder / "Lump.fmu") as plain:
        files = {name: plain.read(name) for name in plain.namelist()}
    text = files["modelDescription.xml"].decode().replace("<ModelVariables>", UNITS)
    for name, attribute in (("top", tip[0]), ("tip", tip[0]), ("heat_out", heat[0])):
        text = re.sub(rf'(name="{name}".*?<Real)', rf"\1 {attribute}", text, flags=re.DOTALL)
    with ZipFile(folder / "Lump.fmu", "w") as archive:
        for name, content in (files | {"modelDescription.xml": text.encode()}).items():
            archive.writestr(name, content)
    return str(folder / "Lump.fmu")


CELSIUS = "T - 273.15", "x + 273.15"
RISE = 'degC" declaredType="Rise'
OWN_RISE = 'K" relativeQuantity="true'


@pytest.fixture
def few_ends(monkeypatch):
    """Runs to two ends (s) in place of thirteen; a time constant of 0.16 ms rests at the later one."""
    monkeypatch.setattr("compare.models.fmu.HORIZONS", (1e-4, 1e-2))


@pytest.mark.usefixtures("few_ends", "in_this_process")
@pytest.mark.parametrize(
    ("tip", "heat"),
    [
        (('declaredType="Celsius"', *CELSIUS), ('unit="mW"', "-2e-2*(T - 300)")),
        (('unit="degF"', "(T - 255.37222222222223)*1.8", "x/1.8 + 255.37222222222223"), ("", "-2e-5*(T - 300)")),
    ],
)
def test_declared_units_are_converted(steady, tmp_path, tip, heat):
    """The outputs to SI, and the parameters from SI."""
    model = build(tmp_path, tip=tip, heat=heat)
    for setting, rise in (([], 100.0), (["model.parameters.top=77 degC"], 50.15)):
        checks = compare.solve(load(steady, setting), model=model).checks
        assert checks["tip"].predicted == pytest.approx(rise, rel=1e-6)
        assert checks["heat out"].predicted == pytest.approx(-2e-5 * rise, rel=1e-6)


@pytest.mark.usefixtures("few_ends", "in_this_process")
def test_declared_units_are_converted_over_time(transient, tmp_path):
    model = build(tmp_path, tip=('unit="degC"', *CELSIUS), heat=('unit="uW"', "-20*(T - 300)"))
    run = compare.solve(transient, model=model).traces
    assert run["reduced1d tip"][0] == pytest.approx(300, abs=1e-9)
    assert run["reduced1d tip"][-1] == pytest.approx(400 - 100 * 2.718281828 ** (-5e-4 / 1.6e-4), rel=1e-5)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("unit", "why"),
    [
        ("uW", '"top", for "tip", is in "uW"'),
        ("lm", "not in K"),
        ("furlong", '"furlong", not'),
        (RISE, "difference"),
        (OWN_RISE, "difference"),
    ],
)
def test_units_of_another_dimension_are_refused(steady, tmp_path, unit, why):
    model = build(tmp_path, tip=(f'unit="{unit}"', "T", "x"))
    with pytest.raises(SceneError, match=why):
        compare.solve(load(steady, ['model.outputs={tip = "top"}']), model=model)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    "course",
    ["top - 100*exp(-t/1e-8)", "top - 100*exp(-t/240)", "300 if t < 3e3 else top", "300.01 if t < 2 else top"],
    ids=["10 ns", "4 minutes", "on after an hour", "rests before it moves on"],
)
def test_the_end_value_is_independent_of_the_scale_of_time(steady, tmp_path, course):
    check = compare.solve(steady, model=build(tmp_path, course)).checks["tip"]
    assert check.predicted == pytest.approx(100, rel=1e-6)
    assert check.verdict == "agrees"


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("course", ["300 + t", "300 + 100*sin(1e3*t)"], ids=["ramp", "oscillation"])
def test_an_fmu_without_a_steady_state_is_refused(steady, tmp_path, course):
    with pytest.raises(SceneError, match="does not come to rest"):
        compare.solve(steady, model=build(tmp_path, course))


@pytest.mark.usefixtures("few_ends")
@pytest.mark.parametrize(
    ("course", "why"),
    [("abort()", "it ended its process, with the signal SIGABRT"), ("1/0", "fmi2DoStep failed with status")],
)
def test_an_fmu_that_crashes_is_a_sentence(steady, tmp_path, course, why):
    with pytest.raises(SceneError, match=why):
        compare.solve(steady, model=build(tmp_path, course))


def test_an_fmu_whose_step_says_that_it_failed_has_no_answer(transient, tmp_path):
    """Its last values were taken to hold from then on."""
    with pytest.raises(SceneError, match=r"stops at 102\.0 us of 1\.000 ms: a step of it says that it failed"):
        compare.solve(transient, model=build(tmp_path, steps="current_time < 1e-4"))

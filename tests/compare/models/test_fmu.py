"""Units that an FMU declares, and its steady state, whatever its scale of time."""

import subprocess
from pathlib import Path
from zipfile import ZipFile

import pytest

import compare
from scenes import load
from scenes.errors import SceneError

fmpy = pytest.importorskip("fmpy")
pytestmark = pytest.mark.needs("cc")

SOURCE = """
#include <math.h>
#include <stdlib.h>
#include "fmi2FunctionTypes.h"
typedef struct { double state, time, top; } Model;
static double rate(const Model *m) { double T = m->state, t = m->time, top = m->top; return RATE; }
fmi2Component fmi2Instantiate(fmi2String a, fmi2Type b, fmi2String c, fmi2String d, const fmi2CallbackFunctions *e,
                              fmi2Boolean f, fmi2Boolean g) {
    Model *m = calloc(1, sizeof(Model)); m->state = 300; m->top = 400; return m; }
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    Model *m = c;
    for (size_t i = 0; i < n; i++)
        v[i] = r[i] == 0 ? m->state : r[i] == 1 ? rate(m) : r[i] == 2 ? TIP : r[i] == 3 ? HEAT : m->top;
    return fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) if (r[i] == 4) ((Model *)c)->top = TOP(v[i]);
    return fmi2OK; }
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { ((Model *)c)->time = t; return fmi2OK; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    ((Model *)c)->state = x[0]; return fmi2OK; }
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    x[0] = ((Model *)c)->state; return fmi2OK; }
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real x[], size_t n) { x[0] = rate(c); return fmi2OK; }
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { x[0] = 1; return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *e) {
    e->newDiscreteStatesNeeded = e->terminateSimulation = e->nextEventTimeDefined = 0;
    e->nominalsOfContinuousStatesChanged = e->valuesOfContinuousStatesChanged = 0; return fmi2OK; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean a, fmi2Boolean *b, fmi2Boolean *d) {
    *b = *d = 0; return fmi2OK; }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real t, fmi2Boolean d, fmi2Real e) {
    return fmi2OK; }
"""
PLAIN = """EnterInitializationMode ExitInitializationMode Terminate Reset EnterEventMode EnterContinuousTimeMode
SetDebugLogging GetEventIndicators GetInteger GetBoolean GetString SetInteger SetBoolean SetString GetFMUstate
SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative"""

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Lump" guid="1" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="Lump"/>
<UnitDefinitions>
<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
<Unit name="degF"><BaseUnit K="1" factor="0.5555555555555556" offset="255.37222222222223"/></Unit>
<Unit name="uW"><BaseUnit kg="1" m="2" s="-3" factor="1e-6"/></Unit>
<Unit name="lm"><BaseUnit cd="1"/></Unit>
</UnitDefinitions>
<TypeDefinitions><SimpleType name="Celsius"><Real unit="degC"/></SimpleType></TypeDefinitions>
<ModelVariables>
<ScalarVariable name="T" valueReference="0" variability="continuous" initial="exact">
<Real start="300"/></ScalarVariable>
<ScalarVariable name="rate" valueReference="1" variability="continuous"><Real derivative="1"/></ScalarVariable>
<ScalarVariable name="tip" valueReference="2" causality="output"><Real {tip}/></ScalarVariable>
<ScalarVariable name="heat_out" valueReference="3" causality="output"><Real {heat}/></ScalarVariable>
<ScalarVariable name="top" valueReference="4" causality="parameter" variability="fixed" initial="exact">
<Real start="400" {tip}/></ScalarVariable>
</ModelVariables>
<ModelStructure><Derivatives><Unknown index="2"/></Derivatives></ModelStructure>
</fmiModelDescription>"""


def build(
    folder: Path, rate: str = "(top - T)/1.6e-4", tip: tuple[str, str, str] = ("", "T", "x"),
    heat: tuple[str, str] = ("", "-2e-5*(T - 300)"),
) -> str:  # fmt: skip
    """Return the path of an FMU with dT/dt = ``rate`` and T = 300 K at the start.

    ``tip`` and ``heat`` are attributes of the outputs and their values, and the first the conversion of the parameter
    "top" back to kelvins.
    """
    source = SOURCE + "".join(f"\nfmi2Status fmi2{name}() {{ return fmi2OK; }}" for name in PLAIN.split())
    source += '\nconst char *fmi2GetTypesPlatform(void) { return "default"; }'
    source += '\nconst char *fmi2GetVersion(void) { return "2.0"; }\n'
    (folder / "lump.c").write_text(source, encoding="utf-8")
    macros = [f"-DRATE={rate}", f"-DTIP=({tip[1].replace('T', 'm->state')})", f"-DTOP(x)=({tip[2]})",
              f"-DHEAT=({heat[1].replace('T', 'm->state')})"]  # fmt: skip
    include = f"-I{Path(fmpy.__file__).parent / 'c-code'}"
    command = ["cc", "-shared", "-fPIC", include, *macros, "-o", "Lump.so", "lump.c", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    with ZipFile(folder / "Lump.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.format(tip=tip[0], heat=heat[0]))
        archive.write(folder / "Lump.so", "binaries/linux64/Lump.so")
    return str(folder / "Lump.fmu")


CELSIUS = "T - 273.15", "x + 273.15"


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
    ("unit", "why"), [("uW", '"tip" is in "uW", not in K'), ("lm", "not in K"), ("furlong", "is not known")]
)
def test_units_of_another_dimension_are_refused(steady, tmp_path, unit, why):
    with pytest.raises(SceneError, match=why):
        compare.solve(steady, model=build(tmp_path, tip=(f'unit="{unit}"', "T", "x")))


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    "rate",
    [
        "(top - T)/1e-8",
        "(top - T)/240.0",
        "(t < 3e3 ? 0 : (top - T)/1e-5)",
        "(t < 2 ? (300.01 - T)/1e-3 : (top - T)/1e-2)",
    ],
    ids=["10 ns", "4 minutes", "on after an hour", "rests before it moves on"],
)
def test_the_end_value_is_independent_of_the_scale_of_time(steady, tmp_path, rate):
    check = compare.solve(steady, model=build(tmp_path, rate)).checks["tip"]
    assert check.predicted == pytest.approx(100, rel=1e-6)
    assert check.verdict == "agrees"


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("rate", ["1.0", "1e5*cos(1e3*t)"], ids=["ramp", "oscillation"])
def test_an_fmu_without_a_steady_state_is_refused(steady, tmp_path, rate):
    with pytest.raises(SceneError, match="does not come to rest"):
        compare.solve(steady, model=build(tmp_path, rate))


@pytest.mark.usefixtures("few_ends")
def test_an_fmu_that_crashes_is_a_sentence(steady, tmp_path):
    with pytest.raises(SceneError, match="it ended its process, with the signal SIGABRT"):
        compare.solve(steady, model=build(tmp_path, "(abort(), 1.0)"))

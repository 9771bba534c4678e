# SPDX-License-Identifier: Apache-2.0
"""Shapes hold the laws that rigs of other makers have: fitted without noise by sums of their atoms, signs kept."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.rig_logs import signals_of, simulated
from scipy.optimize import lsq_linear, minimize_scalar

from pneumo_ros.effects.composition import CORRECTIONS
from pneumo_ros.effects.contract import Effect, Ends, Inputs
from pneumo_ros.effects.hooks import Air, Strut, Tyre, air_of
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.effects.shapes import air as airs
from pneumo_ros.effects.shapes import tyre as tyres
from pneumo_ros.effects.shapes.families import SHAPES
from pneumo_ros.effects.shapes.force import SLACKS
from pneumo_ros.effects.shapes.signals import RESTS
from pneumo_ros.laws.friction import slid
from pneumo_ros.rig import load_rig
from pneumo_ros.units import ATMOSPHERE, GAS_CONSTANT

PERIOD = 2e-3  # s
REST, STIFFNESS = 0.0166, 14000.0  # m, N/m: the front tyre of the nominal rig


def left_of(atoms: np.ndarray, signed: list[bool], law: np.ndarray, free: np.ndarray, most: float = np.inf) -> float:
    """Share, rms, of a law that a shape's atoms cannot make; ``free`` is what the tolerances answer, of either sign and
    ``most`` times at most.
    """
    table = np.column_stack([atoms, free])
    size = np.maximum(np.linalg.norm(table, axis=0), 1e-12)
    table = table / size
    answered = most * size[len(signed) :]
    low = np.array([*(-np.inf if either else 0.0 for either in signed), *-answered])
    found = lsq_linear(table, law, bounds=(low, np.array([*[np.inf] * len(signed), *answered])))
    return float(np.linalg.norm(table @ found.x - law) / np.linalg.norm(law))


def signs(effect: Effect) -> list[bool]:
    return [p.low < 0.0 for p in effect.parameters]


PUSHES = {
    "progressive": lambda r: np.maximum(r, 0.0) ** 1.1,
    "lets go smoothly": lambda r: (r + np.sqrt(r * r + 0.16)) / (1.0 + np.sqrt(1.16)),
    "lets go late": lambda r: (r + np.sqrt(r * r + 0.25)) / (1.0 + np.sqrt(1.25)),
    "touches early": lambda r: np.log1p(np.exp(4.0 * r)) / np.log1p(np.exp(4.0)),
    "hard end": lambda r: np.maximum(r, 0.0),
}


@pytest.mark.parametrize(
    ("name", "least"), [*((name, -0.5) for name in PUSHES), *((name, 0.2) for name in PUSHES if name != "hard end")]
)
def test_a_tyre_that_only_pushes_is_a_lift_off_of_some_law(name: str, least: float) -> None:
    """From ``least`` of the compression at rest on: where the wheel stays on the ground, a law that lets go smoothly is
    a softer tyre about its rest, by more than a tolerance of one sigma answers.
    """
    compression = np.linspace(least * REST, 2.2 * REST, 200)
    shape = SHAPES["tyre_liftoff.shape"]
    extra = STIFFNESS * (REST * PUSHES[name](compression / REST) - compression)
    atoms = []
    for column in shape.columns:
        p = tuple(float(k == column) for k in range(len(tyres.ATOMS)))
        seen = (
            Tyre(float(c), 0.0, STIFFNESS * float(c), 0.0, 0.0, REST, STIFFNESS * REST, 0.0, 0.0) for c in compression
        )
        atoms.append([tyres.tyre(one, (0.0, 0.0), p) for one in seen])
    (std,) = (one.std for one in RigModel(load_rig()).parameters if one.name == "tyre_stiffness_front")
    left = left_of(np.array(atoms).T, signs(shape), extra, compression[:, None], std)
    assert left < (0.05 if least < 0.0 else 0.1)


def test_friction_that_saturates_late_and_a_damper_that_opens_early_are_the_same_curve() -> None:
    """Between 12 and 40 mm/s either may be called: what is left tells nothing, the curve does."""
    from pneumo_ros.effects.shapes.force import ATOMS, force

    rate = np.linspace(-0.3, 0.3, 301)
    law = -np.clip(rate / 0.03, -1.0, 1.0)
    for family in ("coulomb_friction", "viscous_damping"):
        shape = SHAPES[f"{family}.shape"]
        atoms = []
        for column in shape.columns:
            p = tuple(float(k == column) for k in range(len(ATOMS)))
            seen = (Strut(0.0457, float(v), 2.5e5, 1.6e-3, 0.0, 0.0, 0.0) for v in rate)
            atoms.append([force(one, (0.0,) * 8, p) for one in seen])
        assert left_of(np.array(atoms).T, signs(shape), law, rate[:, None]) < 0.1, family


@pytest.mark.parametrize(("bent", "rest"), [(2.0, 1.5e5), (2.0, 3e5), (0.0, 2.5e5)])
def test_bellows_that_widen_with_pressure_are_an_area_error(bent: float, rest: float) -> None:
    """e (q + bent q^2), q the pressure over that at rest in 100 kPa: the second power is more than half of it once the
    valves have moved the pressure by 50 kPa.
    """
    from pneumo_ros.effects.shapes.force import ATOMS, force

    shape = SHAPES["effective_area_error.shape"]
    gauge = rest + np.linspace(-1e5, 1.5e5, 101)
    over = (gauge - rest) / 1e5
    law = 0.01 * (over + bent * over**2) * gauge * 1.6e-3
    atoms = []
    for column in shape.columns:
        p = tuple(float(k == column) for k in range(len(ATOMS)))
        seen = (Strut(0.0457, 0.0, float(one), 1.6e-3, 0.0, 0.0, 0.0) for one in gauge)
        atoms.append([force(one, (0.0,) * 8, p) for one in seen])
    table = np.array(atoms).T
    assert left_of(table, signs(shape), law, gauge[:, None]) < 1e-3
    straight = [k for k, one in enumerate(shape.parameters) if one.name != "area pressure squared"]
    less = left_of(table[:, straight], [signs(shape)[k] for k in straight], law, gauge[:, None])
    assert (less > 0.1) == (bent > 0.0)


def test_sliders_of_all_lengths_are_a_hysteresis() -> None:
    """Slip forces of a power law up to 5 mm (Segalman 2005), most of them short: not friction beside a hysteresis."""
    time = np.arange(6000) * PERIOD
    moved = np.diff(3e-3 * np.sin(7.0 * time) + 1.5e-3 * np.sin(17.3 * time), prepend=0.0)
    slacks = np.linspace(2e-5, 5e-3, 250)
    force = slacks**0.2  # that each slips at
    atoms = [s for s in SLACKS if f"slider {s:g} m" in [p.name for p in SHAPES["bellows_hysteresis.shape"].parameters]]

    def slipped(slack: float) -> np.ndarray:
        z = np.zeros(len(moved) + 1)
        for i, step in enumerate(moved):
            z[i + 1] = slid(z[i], step / slack)
        return z[1:]

    law = np.sum([f * slipped(s) for f, s in zip(force, slacks, strict=True)], axis=0)
    table = np.column_stack([slipped(s) for s in atoms])
    whole, longer = (left_of(t, [False] * t.shape[1], law, np.zeros((len(law), 0))) for t in (table, table[:, 1:]))
    assert min(atoms) == SLACKS[1] and whole < 0.1 < longer


@pytest.mark.parametrize("channel", [0, 3, 4])
def test_a_sensor_with_another_sensitivity_on_one_side_of_its_rest(channel: int) -> None:
    name = "pressure_scale.shape" if channel > 3 else "lvdt_scale.shape"
    shape, swing = SHAPES[name], 5e4 if channel > 3 else 0.01
    reading = np.zeros((101, 6))
    reading[:, channel] = RESTS[channel] + swing * np.linspace(-1.5, 1.5, 101)
    values = tuple(0.2 if p.name == "scale above 0" else 0.0 for p in shape.parameters)
    assert shape.outputs is not None
    shown, _ = shape.outputs(reading, PERIOD, (channel,), values, None)
    error = shown[:, channel] - reading[:, channel]
    assert np.allclose(error, 0.2 * np.maximum(reading[:, channel] - RESTS[channel], 0.0), atol=1e-9 * swing)


@pytest.mark.parametrize("channel", [1, 5])
def test_a_sensors_curve_bends_no_further_from_its_end_on_and_its_slope_goes_on(channel: int) -> None:
    name = "pressure_scale.shape" if channel > 3 else "lvdt_scale.shape"
    shape, swing = SHAPES[name], 5e4 if channel > 3 else 0.01
    reading = np.zeros((301, 6))
    z = np.linspace(-3.0, 3.0, 301)
    reading[:, channel] = RESTS[channel] + swing * z
    of_name = {"error of power 1": 0.1, "error of power 3": 0.2, "end of the curve": 1.5}
    values = tuple(of_name.get(p.name, 0.0) for p in shape.parameters)
    assert shape.outputs is not None
    shown, _ = shape.outputs(reading, PERIOD, (channel,), values, None)
    error = (shown[:, channel] - reading[:, channel]) / swing
    assert np.allclose(error, 0.1 * z + 0.2 * np.clip(z, -1.5, 1.5) ** 3, atol=1e-9)


def test_a_valve_that_opens_slowly_and_closes_at_once() -> None:
    shape = SHAPES["valve_lag.shape"]
    opened = np.r_[np.zeros(50), np.full(200, 1e-6), np.zeros(200)]
    values = [p.typical if not p.size else float(p.name == "slow opening 0.03 s") for p in shape.parameters]
    given = Inputs(np.tile(opened[:, None], (1, 4)), np.zeros((451, 2)))
    assert shape.inputs is not None
    after, _ = shape.inputs(given, PERIOD, Ends(True, False), tuple(values), None)
    valve, time = after.commands[:, 0], PERIOD * np.arange(1, 51)
    assert np.allclose(valve[50:100], 1e-6 * (1.0 - np.exp(-time / 0.03)), rtol=1e-6)
    assert np.all(valve[260:] < 1e-9) and np.array_equal(after.commands[:, 1], opened)


def test_commands_that_come_late_by_two_delays() -> None:
    shape = SHAPES["transport_delay.shape"]
    step = np.r_[np.zeros(100), np.ones(100)]
    values = tuple({"delay 0.008 s": 0.25, "delay 0.032 s": 0.75}.get(p.name, 0.0) for p in shape.parameters)
    given = Inputs(np.tile(step[:, None], (1, 4)), np.zeros((201, 2)))
    assert shape.inputs is not None
    late = shape.inputs(given, PERIOD, Ends(True, False), values, None)[0].commands[:, 0]
    assert np.allclose(late[100:104], 0.0) and np.allclose(late[104:116], 0.25) and np.allclose(late[116:], 1.0)


def test_a_load_brings_its_inertia_and_a_shift() -> None:
    model = RigModel(load_rig())
    nominal = model.plant(model_centre(model), ()).body
    shape = SHAPES["payload.shape"]
    assert shape.plant is not None
    changed = shape.plant(model.plant(model_centre(model), ()), Ends(True, True), (0.3, 0.01, 0.0)).body
    assert changed.pitch_inertia == pytest.approx(nominal.pitch_inertia + 0.3)
    assert changed.front_arm + changed.rear_arm == pytest.approx(nominal.front_arm + nominal.rear_arm)
    assert nominal.front_arm - changed.front_arm == pytest.approx(0.01)


@pytest.mark.parametrize(("effect", "values"), [("payload.shape", (0.0, 0.0)), ("cg_shift.shape", (0.0,))])
def test_what_tips_presses_with_a_moment_in_proportion_to_pitch(effect: str, values: tuple[float, ...]) -> None:
    """k (z_f - z_r) on either end is k L^2 a radian, and as a moment of that size it moves the rig."""
    model, log = RigModel(load_rig()), signals_of(*simulated(seconds=4.0))
    body, stiffness = model.plant().body, 400.0  # N/m
    wheelbase = body.front_arm + body.rear_arm
    tipping = Active(effect, "", (*values, stiffness))
    firm, tipped = model.states(log), model.states(log, active=(tipping,))
    assert np.ptp(tipped[:, 1]) > 1.02 * np.ptp(firm[:, 1])  # it tips further
    moment = np.zeros((len(log.commands), len(CORRECTIONS)))
    held = 0.5 * (tipped[:-1, 1] + tipped[1:, 1]) - tipped[0, 1]  # over each period
    moment[:-1, CORRECTIONS.index("body_pitch")] = stiffness * wheelbase**2 * held
    same = model.states(log, correction=moment)
    assert np.abs(same[:, 1] - tipped[:, 1]).max() < 0.01 * np.abs(firm[:, 1] - tipped[:, 1]).max()


def model_centre(model: RigModel) -> np.ndarray:
    return np.array([p.nominal for p in model.parameters])


@pytest.mark.parametrize("end", ["front", "rear"])
@pytest.mark.parametrize("margin", [-0.06, -0.02, 0.03])
def test_a_lip_that_opens_above_a_pressure_is_a_leak_wherever_the_spring_rests(end: str, margin: float) -> None:
    """Flow in proportion to what the pressure exceeds; the opening is fitted, the corners of an outlet's error are
    none.
    """
    rest = RESTS[4 if end == "front" else 5]
    gas = getattr(RigModel(load_rig()).plant(), end)
    pressures = np.linspace(0.8 * rest, 1.25 * rest, 120)
    signals = [air_of(float(p), 0.045, 0.0, 0.0, 0.0, gas.supply_pressure, gas.supply_power, gas) for p in pressures]
    law = -1e-9 * np.maximum(pressures - (1.0 + margin) * rest, 0.0)  # kg/s

    def flows(opens: float) -> np.ndarray:
        z = (rest * signals[0].volume, *[signals[0].temperature] * 3, 0.0, 0.0, rest, rest)
        out = []
        for column in (0, 1, *SHAPES["leak.shape"].columns[:1]):  # the law's hole and gap, and the shape's
            p = [0.0] * len(airs.ATOMS)
            p[column], p[3] = 1.0, opens
            out.append([airs.air(s, z, tuple(p)) * s.volume / (s.exponent * s.temperature) for s in signals])
        return np.array(out).T

    nothing = np.zeros((len(law), 1))
    signed = [False, False, signs(SHAPES["leak.shape"])[0]]
    assert left_of(flows(0.0)[:, :2], signed[:2], law, nothing) > 0.25, "no hole and no gap opens"
    assert left_of(flows(margin), signed, law, nothing) < 0.06  # a hole that opens lets pass the more, the higher it is


@pytest.mark.parametrize("part", [0.3, 0.5, 0.7])
def test_a_fitting_that_leaks_passes_less_than_any_hole_and_gap_together(part: float) -> None:
    """A capillary, which takes ``part`` of the difference of squares at 3 bar, before an orifice: W/a + W^2/b
    (Forchheimer 1901). Of a leak as large as a tenth of an outlet half a per cent is as much as the sensors' noise.
    """
    gas = RigModel(load_rig()).plant().front
    pressures = np.linspace(2.1e5, 3.4e5, 120)
    signals = [air_of(float(p), 0.045, 0.0, 0.0, 0.0, gas.supply_pressure, gas.supply_power, gas) for p in pressures]
    drive = (pressures**2 - ATMOSPHERE**2) * np.array([1.0 / s.temperature for s in signals])
    drive /= (airs.REFERENCE**2 - ATMOSPHERE**2) / 293.0
    a, b = 1e-4 / part, 1e-8 / (1.0 - part)  # kg/s, kg2/s2
    law = -2.0 * drive / (1.0 / a + np.sqrt(1.0 / a**2 + 4.0 * drive / b))
    atoms = []
    gauged = next(k for k, atom in enumerate(airs.ATOMS) if atom.name == "leak over gauge pressure")
    for column in (0, 1, gauged):  # the law's hole and gap, and the shape's
        p = tuple(float(k == column) for k in range(len(airs.ATOMS)))
        z = (1.0, *[gas.supply_temperature] * 3, 0.0, 0.0, 2.7e5, 2.7e5)
        atoms.append([airs.air(s, z, p) * s.volume / (s.exponent * s.temperature) for s in signals])
    table, nothing = np.array(atoms).T, np.zeros((len(law), 1))
    alone, beside = (left_of(table[:, :k], [False] * k, law, nothing) for k in (2, 3))
    assert alone > 0.005
    assert beside < 0.75 * alone


@pytest.mark.parametrize("critical", [0.15, 0.3, 0.45])
def test_an_inlet_that_unchokes_at_its_own_pressure_ratio(critical: float) -> None:
    """ISO 6358's ellipse with a critical ratio of its own over Eq. 4.7's flow, which unchokes at 0.528: what a line
    over the ratio leaves was called a leak or heat.
    """
    ratios = np.linspace(0.25, 0.9, 120)
    past = np.maximum(ratios - critical, 0.0) / (1.0 - critical)
    nominal = np.maximum(ratios - 0.528, 0.0) / (1.0 - 0.528)
    flow = 1e-3 * np.sqrt(1.0 - nominal**2)  # kg/s
    law = 1e-3 * np.sqrt(1.0 - past**2) - flow
    names = [a.name for a in airs.ATOMS]
    columns = [k for k in SHAPES["orifice_coefficient.shape"].columns if names[k].startswith("inlet")]
    gas = RigModel(load_rig()).plant().front
    atoms = []
    for column in columns:
        p = tuple(float(k == column) for k in range(len(names)))
        seen = []
        for ratio, inflow in zip(ratios, flow, strict=True):
            one = air_of(
                float(ratio) * gas.supply_pressure, 0.045, 0.0, 0.0, 0.0, gas.supply_pressure, gas.supply_power, gas
            )
            one = one._replace(inflow=float(inflow), outflow=0.0)
            z = (one.pressure * one.volume, *[one.temperature] * 3, 0.0, 0.0, one.pressure, one.pressure)
            seen.append(airs.air(one, z, p) * one.volume / (one.exponent * one.temperature))
        atoms.append(seen)
    table, nothing = np.array(atoms).T, np.zeros((len(law), 0))
    straight = [k for k, column in enumerate(columns) if "past" not in names[column]]
    line = left_of(table[:, straight], [True] * len(straight), law, nothing)
    whole = left_of(table, [True] * len(columns), law, nothing)
    assert whole < 0.08 and whole < 0.5 * line


def spring_air(pressure: float, inflow: float = 0.0) -> Air:
    """The front spring's air at rest, valves closed but for an inflow, kg/s."""
    gas = RigModel(load_rig()).plant().front
    one = air_of(pressure, 0.045, 0.0, 0.0, 0.0, gas.supply_pressure, gas.supply_power, gas)
    return one._replace(inflow=inflow, outflow=0.0)


@pytest.mark.parametrize(("vessel", "coefficient"), [(1e-5, 1e-6), (1e-4, 5e-6), (1e-4, 1e-6)])
def test_a_second_chamber_behind_an_orifice_of_its_own(vessel: float, coefficient: float) -> None:
    """W = K sqrt(dP) into a vessel whose air follows the polytrope (Eq. 4.22), while the spring's pressure swings by
    20 kPa at 1 and 4 Hz: no volume that is off takes the same.
    """
    step, count = 2e-3, 2000
    time = step * np.arange(count)
    pressure = RESTS[4] + 2e4 * (0.6 * np.sin(2.0 * np.pi * time) + 0.4 * np.sin(8.0 * np.pi * time))
    signals = [spring_air(float(p)) for p in pressure]
    per_mass = [a.exponent * GAS_CONSTANT * a.temperature / vessel for a in signals]
    inside, law = pressure[0], []
    for p, rate in zip(pressure, per_mass, strict=True):
        began = inside
        for _ in range(200):  # a step of its own: the vessel fills in milliseconds
            inside += 0.005 * step * rate * coefficient * (p - inside) / np.sqrt(abs(p - inside) + 200.0)
        law.append((began - inside) / (step * rate))
    chamber, fills = (next(k for k, a in enumerate(airs.ATOMS) if a.name == name) for name in ("chamber", "fills in"))

    nothing, target = np.zeros((count, 0)), np.array(law)

    def left(log_fills_in: float) -> float:
        fills_in = float(np.exp(log_fills_in))
        p = tuple({chamber: 1.0, fills: fills_in}.get(k, 0.0) for k in range(len(airs.ATOMS)))
        z, out = airs.start(None, signals[0], None, p), []
        for one in signals:
            out.append(airs.air(one, z, p) * one.volume / (one.exponent * GAS_CONSTANT * one.temperature))
            z = airs.advance(z, None, one, None, step, p)
        return left_of(np.array(out)[:, None], [False], target, nothing)

    as_volume = left_of(np.gradient(pressure, step)[:, None], [True], target, nothing)
    least = float(minimize_scalar(left, bounds=(np.log(0.005), 0.0), options={"xatol": 0.1}).fun)
    assert least < 0.12 and least < 0.5 * as_volume


def test_walls_follow_the_temperature_of_the_mass_that_is_there() -> None:
    """Twice the mass in the same volume at twice the pressure is as warm as before, whatever the polytrope says."""
    p = (0.0,) * len(airs.ATOMS)
    before, after = spring_air(RESTS[4]), spring_air(2.0 * RESTS[4])
    z = airs.start(None, before, None, p)
    assert z[1:4] == (before.supply_temperature,) * 3
    doubled = airs.advance((2.0 * z[0], *z[1:]), None, after, None, 1e-3, p)
    assert np.allclose(doubled[1:4], before.supply_temperature)
    warm = airs.advance(z, None, after, None, 1e-3, p)
    assert warm[1] > warm[2] > warm[3] > before.supply_temperature


@pytest.mark.parametrize("power", [0.5, 1.5, 2.5])
def test_a_tyre_that_loses_more_under_load(power: float) -> None:
    """A loss in proportion to the rate and a power of the compression: a rolling tyre's is steeper than linear."""
    rng = np.random.default_rng(3)
    rate, compression = rng.uniform(-0.15, 0.15, 400), rng.uniform(0.0, 2.0 * REST, 400)
    law = 20.0 * rate * (compression / REST) ** power
    shape = SHAPES["tyre_damping.shape"]
    atoms = []
    for column in shape.columns:
        p = tuple(float(k == column) for k in range(len(tyres.ATOMS)))
        rows = zip(rate, compression, strict=True)
        loaded = (Tyre(float(c), float(v), STIFFNESS * float(c), 0.0, 0.0, REST, 0.0, 0.0, 0.0) for v, c in rows)
        atoms.append([tyres.tyre(one, (0.0, 0.0), p) for one in loaded])
    table = np.array(atoms).T
    names = [tyres.ATOMS[k].name for k in shape.columns]
    straight = [k for k, name in enumerate(names) if " to the " not in name]
    nothing = np.zeros((len(law), 0))
    whole = left_of(table, signs(shape), law, nothing)
    assert whole < 0.12
    assert power < 1.0 or whole < 0.3 * left_of(table[:, straight], [False] * len(straight), law, nothing)


@pytest.mark.parametrize("name", ["valve_lag.shape", "exciter_lag.shape", "pressure_lag.shape"])
def test_a_follower_begins_as_all_of_a_slow_part(name: str) -> None:
    """Slow one way and quick the other without a limit, or limited, and none of the mixture: within all bounds."""
    shape = SHAPES[name]
    assert len(shape.begins) == 4
    (most,) = (p.high for p in shape.parameters if p.name == "slew")
    slews = []
    for values in shape.begins:
        of_name = dict(zip((p.name for p in shape.parameters), values, strict=True))
        assert all(p.low <= v <= p.high for p, v in zip(shape.parameters, values, strict=True))
        assert {p.name for p in shape.parameters if p.size and of_name[p.name] != 0.0} == {"follower"}
        assert of_name["follower"] == 1.0
        slews.append(of_name["slew"])
    first, second = (values[-2:] for values in shape.begins[:2])
    assert first == second[::-1] and first[0] != first[1] and slews[:2] == [most, most]
    assert slews[2] < slews[3] < most

"""The JSBSim adapter: one Cessna 172P under autopilot. All flights go through it.

JSBSim gives the flight and the engine's speed, power and fuel flow; its own temperature and
pressure channels are not used (``core.twin.sensors`` synthesises those). Only the bench, which
measures what this adapter adds, drives JSBSim beside it.

JSBSim's c172p has power to spare. What keeps a nominal flight inside the limits of a real 172 is
that its throttle is set by trimming for the plan's airspeed, and that a speed which takes the
engine past its red line (``core.channels``) is refused at the start. On later legs the throttle
may still be opened too far: such a flight is not refused but says so (``core.twin.events``).

The autopilot's loops are tuned for an engine that gives what they ask. One that has failed does
not: integrals wind up, and a capture that ends by the clock leaves them where they are. So as soon
as somebody acts on a flight it is guarded: integrals stand still at the stops, the throttle stops
at the red line, and a capture lasts until it is one (`Pilot`). Until then no byte differs.
"""

import tempfile
import xml.etree.ElementTree as ElementTree
from array import array
from collections.abc import Callable
from functools import cache
from pathlib import Path

import jsbsim
import numpy as np

from core.arrays import Array
from core.channels import channel
from core.clock import DT_S, STEPS_PER_TICK
from core.errors import FlightError
from core.fmea.laws import Drivers
from core.fmea.powerplant import HEALTHY, EngineFactors
from core.paths import DATA
from core.twin.aircraft import drivers_at
from core.twin.conditions import FUEL_LB, Setting
from core.twin.constants import CRUISE_MIXTURE, CRUISE_PSF
from core.twin.hand import STILL, Drift, Hand
from core.twin.pilot import Pilot, Targets, Where
from core.twin.plan import Leg, Plan, Weather
from core.twin.trajectory import GROUND_FT, STATE_INDEX, STATE_NAMES

_FPS_TO_FPM = 60.0
_M_PER_S_PER_KT = 1852.0 / 3600.0
_LB_PER_GAL = 6.02
_ENGINE = "propulsion/engine/"

# One for good: JSBSim keeps a thread's logger until the thread ends, and lets it go without asking
# Python, which dies of it if that was the last to hold it (JSBSim 1.3.3).
_QUIET = jsbsim.DefaultLogger(jsbsim.LogLevel.FATAL)

# JSBSim property and (factor, offset) into the state's unit, in STATE_NAMES order.
_STATE_PROPERTIES: tuple[tuple[str, float, float], ...] = (
    ("position/from-start-neu-n-ft", 0.3048, 0.0),
    ("position/from-start-neu-e-ft", 0.3048, 0.0),
    ("position/h-sl-ft", 1.0, 0.0),
    ("attitude/phi-deg", 1.0, 0.0),
    ("attitude/theta-deg", 1.0, 0.0),
    ("attitude/psi-deg", 1.0, 0.0),
    ("velocities/vc-kts", 1.0, 0.0),
    ("velocities/h-dot-fps", _FPS_TO_FPM, 0.0),
    ("accelerations/Nz", 1.0, 0.0),
    ("aero/alpha-deg", 1.0, 0.0),
    ("aero/qbar-psf", 1.0, 0.0),
    (_ENGINE + "engine-rpm", 1.0, 0.0),
    (_ENGINE + "power-hp", 1.0, 0.0),
    (_ENGINE + "fuel-flow-rate-gph", 1.0, 0.0),
    (_ENGINE + "map-inhg", 1.0, 0.0),
    ("fcs/throttle-pos-norm", 1.0, 0.0),
    ("atmosphere/T-R", 5.0 / 9.0, -273.15),
    ("propulsion/tank/contents-lbs", 1.0 / _LB_PER_GAL, 0.0),
    ("propulsion/tank[1]/contents-lbs", 1.0 / _LB_PER_GAL, 0.0),
    (_ENGINE + "AFR", 1.0, 0.0),
)
assert len(_STATE_PROPERTIES) == len(STATE_NAMES)

_STEERING_PROPERTIES = (
    "ap/target-altitude-ft", "ap/target-climb-fps", "ap/target-speed-kt", "ap/target-heading-rad",
    "ap/capture", "ap/speed-hold", "ap/power-for-climb-fps",
)  # fmt: skip

_TRIM_OFFSET_RAD = (-0.15, 0.20)
_THROTTLE_OFFSET_NORM = (-0.7, 0.3)
"""Between what the two integrals are held in the autopilot while nobody has acted."""

_SCALE = np.array([factor for _, factor, _ in _STATE_PROPERTIES])
_OFFSET = np.array([offset for _, _, offset in _STATE_PROPERTIES])


@cache
def _aircraft_folder() -> tempfile.TemporaryDirectory[str]:
    """A folder with JSBSim's own c172p plus our autopilot as a system of it, gone at exit.

    The aircraft file comes from the installed JSBSim and is not copied into this repository. Its
    wheels and skids are left out: off the ground they change no bit of a flight, and looking for
    the ground under each of them takes a fifth of JSBSim's time. There is no landing here: a
    flight that comes down to sea level is over.
    """
    root = Path(jsbsim.get_default_root_dir())
    original = ElementTree.parse(root / "aircraft" / "c172p" / "c172p.xml")
    model = original.getroot()
    controls, ground = model.find("flight_control"), model.find("ground_reactions")
    if controls is None or ground is None:
        raise FlightError(f"JSBSim {jsbsim.__version__} has a c172p that MirrorTwin cannot extend")
    autopilot = ElementTree.Element("system", file="mirrortwin_autopilot")
    model.insert(list(model).index(controls), autopilot)
    for contact in ground.findall("contact"):
        ground.remove(contact)
    folder = tempfile.TemporaryDirectory(prefix="mirrortwin-aircraft-")
    aircraft = Path(folder.name) / "c172p"
    aircraft.mkdir()
    original.write(aircraft / "c172p.xml", encoding="utf-8")
    return folder


def _load() -> jsbsim.FGFDMExec:
    jsbsim.set_logger(_QUIET)
    executive = jsbsim.FGFDMExec(None)
    executive.set_debug_level(0)
    engine_folder = str(Path(jsbsim.get_default_root_dir()) / "engine")
    if not executive.load_model_with_paths(
        "c172p", _aircraft_folder().name, engine_folder, str(DATA / "aircraft")
    ):
        raise FlightError("JSBSim could not load the c172p with the autopilot")
    executive.set_dt(DT_S)
    return executive


def _drift(weather: Weather) -> Array | None:
    """What a steady wind adds to the states each step, (states,); None in calm.

    JSBSim forgets its wind when it begins a flight, and cannot trim in one. A steady wind carries
    the air as a whole: all that an aircraft feels is as in calm, only its way over ground is not.
    """
    if not weather.wind_kt:
        return None
    toward_rad = np.deg2rad(weather.wind_from_deg + 180.0)
    step_m = weather.wind_kt * _M_PER_S_PER_KT * DT_S
    drift = np.zeros(len(STATE_NAMES))
    drift[STATE_INDEX["north_m"]] = step_m * np.cos(toward_rad)
    drift[STATE_INDEX["east_m"]] = step_m * np.sin(toward_rad)
    return drift


class JsbsimAircraft:
    """An `Aircraft` flown by JSBSim, trimmed level at the plan's altitude, speed and heading."""

    def __init__(self, plan: Plan, setting: Setting) -> None:
        """Load, trim and engage the autopilot; raises `FlightError` if it cannot be trimmed."""
        self._executive = _load()
        self._manager = self._executive.get_property_manager()
        self._set_air(setting.weather, plan.seed)
        self._drift = _drift(setting.weather)
        self._flown = 0
        self._trim(plan, FUEL_LB[setting.conditions])
        self._executive["ap/by-hand"] = float(setting.is_field)
        self._stir(setting.weather)
        self._reads = [self._node(name).get_double_value for name, _, _ in _STATE_PROPERTIES]
        self._throttle = self._node("ap/throttle-correction")
        self._mixture = self._node("fcs/mixture-cmd-norm")
        self._bsfc = self._node(_ENGINE + "bsfc-lbs_hphr")
        self._breathing = self._node(_ENGINE + "volumetric-efficiency")
        self._friction = self._node(_ENGINE + "friction-hp")
        self._healthy_bsfc = self._bsfc.get_double_value()
        self._healthy_breathing = self._breathing.get_double_value()
        self._healthy_friction_hp = self._friction.get_double_value()
        self._factors = HEALTHY
        self._hand = Hand(setting.hand_stream) if setting.hand_stream else None
        self._plan = plan
        self._pilot = Pilot(plan) if plan.legs or self._hand else None
        self._steering = [self._node(name) for name in _STEERING_PROPERTIES]
        self._lever = self._leaned(CRUISE_MIXTURE)
        self._always_holds_speed = plan.power == "speed_hold"
        self._is_guarded = self._is_capturing = self._captured_broken = False
        self._to_restart: set[str] = set()

    def _node(self, name: str) -> jsbsim.FGPropertyNode:
        node = self._manager.get_node(name)
        if node is None:
            raise FlightError(f"JSBSim {jsbsim.__version__} has no property {name}")
        return node

    def _set_air(self, weather: Weather, seed: int) -> None:
        self._executive["atmosphere/delta-T"] = weather.isa_deviation_degc * 1.8
        self._executive["atmosphere/randomseed"] = seed

    def _trim(self, plan: Plan, fuel_lb_range: tuple[float, float]) -> None:
        executive = self._executive
        executive["ic/h-sl-ft"] = plan.altitude_ft
        executive["ic/vc-kts"] = plan.speed_kt
        executive["ic/psi-true-deg"] = plan.heading_deg
        executive["fcs/throttle-cmd-norm"] = 0.75
        executive.run_ic()
        executive["propulsion/set-running"] = -1
        executive["fcs/mixture-cmd-norm"] = self._leaned(CRUISE_MIXTURE)
        fuel_lb = np.random.default_rng([plan.seed, 0xF0E1]).uniform(*fuel_lb_range, 2)
        executive["propulsion/tank/contents-lbs"] = float(fuel_lb[0])
        executive["propulsion/tank[1]/contents-lbs"] = float(fuel_lb[1])
        try:
            executive["simulation/do_simple_trim"] = 1
        except jsbsim.TrimFailureError:
            raise FlightError(
                f"no level flight at {plan.altitude_ft:g} ft and {plan.speed_kt:g} kt: "
                "choose a speed nearer 100 kt or a lower altitude"
            ) from None
        _, red_rpm = channel("E1 RPM").red
        if red_rpm is not None and executive[_ENGINE + "engine-rpm"] > red_rpm:
            raise FlightError(
                f"no level flight at {plan.altitude_ft:g} ft and {plan.speed_kt:g} kt below "
                f"{red_rpm:g} rpm: choose a lower speed or altitude"
            )
        executive["ap/target-altitude-ft"] = plan.altitude_ft
        executive["ap/target-speed-kt"] = plan.speed_kt
        executive["ap/target-heading-rad"] = float(np.deg2rad(plan.heading_deg))
        executive["ap/speed-hold"] = float(plan.power == "speed_hold")
        executive["ap/trim-pitch-rad"] = executive["attitude/theta-rad"]
        executive["ap/trim-roll-rad"] = executive["attitude/phi-rad"]
        executive["ap/trim-elevator-norm"] = executive["fcs/elevator-cmd-norm"]
        executive["ap/trim-aileron-norm"] = executive["fcs/aileron-cmd-norm"]
        executive["ap/trim-throttle-norm"] = executive["fcs/throttle-cmd-norm"]
        executive["ap/engaged"] = 1.0

    def _stir(self, weather: Weather) -> None:
        """Switch on MIL-F-8785C turbulence; after the trim, which needs still air."""
        if weather.turbulence:
            executive = self._executive
            executive["atmosphere/turb-type"] = 3
            executive["atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps"] = 15.0
            executive["atmosphere/turbulence/milspec/severity"] = weather.turbulence

    def _leaned(self, mixture: float) -> float:
        """The lever here for the air-fuel ratio that ``mixture`` gives at 5,000 ft; at most 1."""
        return min(mixture * self._executive["atmosphere/P-psf"] / CRUISE_PSF, 1.0)

    def fly(self, n_steps: int, on_tick: Callable[[Drivers], EngineFactors] | None = None) -> Array:
        """Fly ``n_steps`` and return the states before each step, (n_steps, states).

        They end with the first at `GROUND_FT` or below, if the aircraft comes down to it.
        ``on_tick`` is called every `TICK_S` with what the engine does and returns what to correct
        on it.
        """
        run, reads = self._executive.run, self._reads
        has_ticks = on_tick is not None or self._pilot is not None
        raw = array("d")  # a list would keep every number as an object, all over the memory
        record = raw.fromlist
        for step in range(n_steps):
            row = [read() for read in reads]
            record(row)
            if has_ticks and step % STEPS_PER_TICK == 0:
                self._tick(on_tick(drivers_at(row)) if on_tick else HEALTHY)
            if row[_ALTITUDE] <= GROUND_FT:
                break
            run()
        states: Array = np.frombuffer(raw).reshape(-1, len(reads)) * _SCALE
        states += _OFFSET
        if self._drift is not None:
            states += (self._flown + np.arange(len(states)))[:, None] * self._drift
        self._flown += len(states)
        return states

    def set_targets(self, leg: Leg, tick: int) -> None:
        """Have the pilot take up new targets at ``tick``, which is flown next."""
        self._guarded_pilot(tick).set_targets(leg)

    def recover(self, tick: int) -> None:
        """Fly on from here at ``tick``, the engine being repaired: loops start again."""
        pilot = self._guarded_pilot(tick)
        if self._captured_broken:
            self._to_restart.add(_PITCH)
        if self._holds_speed:
            self._to_restart.add(_THROTTLE)
        pilot.recover(self._where(), finds_power=self._captured_broken)

    def guard(self, tick: int) -> None:
        """Have it guarded from ``tick`` on; what has wound up by then starts again."""
        self._guarded_pilot(tick)

    def _guarded_pilot(self, tick: int) -> Pilot:
        if self._pilot is None:
            self._pilot = Pilot(self._plan, tick)
        if not self._is_guarded:
            self._is_guarded = True
            if not _is_between(self._executive["ap/trim-offset-rad"], _TRIM_OFFSET_RAD):
                self._to_restart.add(_PITCH)
            if not self._holds_speed:
                self._keep_power()
            elif not _is_between(self._executive["ap/throttle-offset-norm"], _THROTTLE_OFFSET_NORM):
                self._to_restart.add(_THROTTLE)
            self._executive["ap/throttle-offset-least-norm"] = -1.0
            self._executive["ap/throttle-offset-most-norm"] = 1.0
            self._executive["ap/guarded"] = 1.0
        return self._pilot

    @property
    def _holds_speed(self) -> bool:
        return self._is_capturing or self._always_holds_speed

    def _where(self) -> Where:
        return Where(self._reads[_ALTITUDE](), self._reads[_IAS]())

    def _keep_power(self) -> None:
        """Make the throttle as it is the one to be held."""
        self._executive["ap/trim-throttle-norm"] += self._executive["ap/throttle-offset-norm"]
        self._to_restart.add(_THROTTLE)

    def correct(self, factors: EngineFactors) -> None:
        """Let the engine run with these corrections."""
        if factors != self._factors:
            self._factors = factors
            self._throttle.set_double_value(factors.throttle)
            self._bsfc.set_double_value(self._healthy_bsfc / factors.work)
            self._breathing.set_double_value(self._healthy_breathing * factors.charge)
            self._friction.set_double_value(self._healthy_friction_hp + factors.friction_hp)
        self._mixture.set_double_value(self._lever * factors.mixture)

    def _tick(self, factors: EngineFactors) -> None:
        if self._pilot is not None:
            targets = self._pilot.next(self._where() if self._is_guarded else None)
            self._follow(self._pilot, targets.capturing, is_broken=factors != HEALTHY)
            self._steer(targets, self._hand.next() if self._hand else STILL)
        self.correct(factors)

    def _follow(self, pilot: Pilot, is_capturing: bool, *, is_broken: bool) -> None:
        """Keep the books of captures: what they found, and whether with a broken engine."""
        if is_capturing and not self._is_capturing:
            self._captured_broken = False
        if is_capturing and is_broken:
            self._captured_broken = True
        ends = self._is_capturing and not is_capturing
        self._is_capturing = is_capturing
        if not self._is_guarded:
            return
        if ends and not self._always_holds_speed:
            if pilot.finds_power:
                self._keep_power()
            self._to_restart.add(_THROTTLE)
        for name in (_PITCH, _THROTTLE):
            self._executive[name] = float(name in self._to_restart)
        self._to_restart.clear()

    def _steer(self, targets: Targets, drift: Drift) -> None:
        values = (
            targets.altitude_ft + drift.altitude_ft,
            targets.climb_fps + drift.climb_fps,
            targets.speed_kt,
            float(np.deg2rad(targets.heading_deg)),
            float(targets.capturing),
            float(targets.capturing or self._always_holds_speed),
            targets.climb_fps if self._hand else 0.0,
        )
        for node, value in zip(self._steering, values, strict=True):
            node.set_double_value(value)
        self._lever = self._leaned(targets.mixture) * (1.0 + drift.mixture)


_IAS, _ALTITUDE = STATE_INDEX["ias_kt"], STATE_INDEX["altitude_ft"]
_PITCH, _THROTTLE = "ap/restart-pitch", "ap/restart-throttle"


def _is_between(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] < value < limits[1]

"""A turboshaft with a free turbine as a pyCycle model, sized and laid out as the product's gas path is.

Thermodynamics are pyCycle's tables of air and Jet-A in equilibrium; they add fuel at no enthalpy at all, where that of
its formation is -1.8 MJ/kg, so that the fuel gives that much more heat than its heating value.
"""

from __future__ import annotations

import openmdao.api as om
import pycycle.api as pyc

ORDER = ("cycle", "fc", "inlet", "compressor", "burner_loss", "burner", "ggt", "duct_loss", "duct", "pt", "nozzle")
SHAFTS = ("accessories", "gg_shaft", "pt_shaft")
# Pressure loss as the square of the flow function: at the design point its level, and what it is referred to.
LOSS = "loss = level * (W / P)**2 * T / reference"
DESIGN_LOSS = ["loss = 1.0 * level", "reference = (W / P)**2 * T"]
TURBINE_SCALARS = ("s_Wp", "s_PR", "s_eff", "s_Np")
SCALARS = {"compressor": ("s_Wc", "s_PR", "s_eff", "s_Nc"), "ggt": TURBINE_SCALARS, "pt": TURBINE_SCALARS}
TABULAR = {"thermo_method": "TABULAR", "thermo_data": pyc.AIR_JETA_TAB_SPEC}
MOST_ITERATIONS = 50
SPEED = 10000.0  # rpm of both shafts at the design point: maps are scaled, only ratios matter


class Turboshaft(pyc.Cycle):
    """Gas generator and free turbine; cooling air goes past combustor and first turbine. Stagnation values only."""

    def setup(self) -> None:
        design = self.options["design"]
        bare = {"design": design, "statics": False}
        maps = {"map_extrap": True, **bare}
        gas_generator, power_turbine = [("Nmech", "gg_speed")], [("Nmech", "pt_speed")]
        self.add_subsystem("fc", pyc.FlightConditions())
        self.add_subsystem("inlet", pyc.Inlet(**bare))
        compressor = pyc.Compressor(map_data=pyc.AXI5, bleed_names=["cooling"], **maps)
        self.add_subsystem("compressor", compressor, promotes_inputs=gas_generator)
        self.add_subsystem("burner", pyc.Combustor(**bare, fuel_type="FAR"))
        turbine = pyc.Turbine(map_data=pyc.LPT2269, bleed_names=["cooling"], **maps)
        self.add_subsystem("ggt", turbine, promotes_inputs=gas_generator)
        self.add_subsystem("duct", pyc.Duct(**bare))
        self.add_subsystem("pt", pyc.Turbine(map_data=pyc.LPT2269, **maps), promotes_inputs=power_turbine)
        self.add_subsystem("nozzle", pyc.Nozzle(nozzType="CV", lossCoef="Cv"))
        self.add_subsystem("gg_shaft", pyc.Shaft(num_ports=2), promotes_inputs=gas_generator)
        self.add_subsystem("pt_shaft", pyc.Shaft(num_ports=1), promotes_inputs=power_turbine)

        flows = ("fc", "inlet", "compressor", "burner", "ggt", "duct", "pt", "nozzle")
        for source, target in zip(flows[:-1], flows[1:], strict=True):
            first = source == "fc"  # the air flow is found by the balances, not given by the flight
            self.pyc_connect_flow(f"{source}.Fl_O", f"{target}.Fl_I", connect_stat=first, connect_w=not first)
        self.pyc_connect_flow("compressor.cooling", "ggt.cooling", connect_stat=False)
        self.connect("compressor.trq", "gg_shaft.trq_0")
        self.connect("ggt.trq", "gg_shaft.trq_1")
        self.connect("pt.trq", "pt_shaft.trq_0")
        self.connect("fc.Fl_O:stat:P", "nozzle.Ps_exhaust")
        self._add_losses(design)
        self._add_balances(design)
        self.set_order([*ORDER, *SHAFTS])
        self._add_solver()
        super().setup()

    def _add_losses(self, design: bool) -> None:
        """Pressure losses that go with the square of the flow function, and accessories that go with the speed."""
        units = {"W": {"units": "kg/s"}, "P": {"units": "Pa"}, "T": {"units": "degK"}}
        for name, source in (("burner", "compressor"), ("duct", "ggt")):
            self.add_subsystem(f"{name}_loss", om.ExecComp(DESIGN_LOSS if design else LOSS, **units))
            self.connect(f"{source}.Fl_O:stat:W", f"{name}_loss.W")
            self.connect(f"{source}.Fl_O:tot:P", f"{name}_loss.P")
            self.connect(f"{source}.Fl_O:tot:T", f"{name}_loss.T")
            self.connect(f"{name}_loss.loss", f"{name}.dPqP")
        units = {"load": {"units": "W"}, "level": {"units": "W/rpm"}, "speed": {"units": "rpm"}}
        load = om.ExecComp("load = level * speed", **units)
        self.add_subsystem("accessories", load, promotes_inputs=[("speed", "gg_speed")])
        self.connect("accessories.load", "gg_shaft.HPX")

    def _add_balances(self, design: bool) -> None:
        cycle = self.add_subsystem("cycle", om.BalanceComp())
        cycle.add_balance("FAR", val=0.018, lower=1e-4, eq_units="degK" if design else "W", rhs_name="demand")
        self.connect("cycle.FAR", "burner.Fl_I:FAR")
        if design:
            self.connect("burner.Fl_O:tot:T", "cycle.lhs:FAR")
            cycle.add_balance("ggt_PR", val=2.6, lower=1.001, upper=8, eq_units="W", rhs_val=0.0)
            self.connect("cycle.ggt_PR", "ggt.PR")
            self.connect("gg_shaft.pwr_net", "cycle.lhs:ggt_PR")
            cycle.add_balance("pt_PR", val=2.4, lower=1.001, upper=8, rhs_name="nozzle_PR")
            self.connect("cycle.pt_PR", "pt.PR")
            self.connect("nozzle.PR", "cycle.lhs:pt_PR")
            cycle.add_balance("pt_eff", val=0.8, lower=0.3, upper=1.0, eq_units="W", rhs_name="power")
            self.connect("cycle.pt_eff", "pt.eff")
            self.connect("pt_shaft.pwr_net", "cycle.lhs:pt_eff")
            return
        self.connect("pt_shaft.pwr_net", "cycle.lhs:FAR")
        cycle.add_balance("speed", val=SPEED, units="rpm", lower=500.0, eq_units="W", rhs_val=0.0)
        self.connect("cycle.speed", "gg_speed")
        self.connect("gg_shaft.pwr_net", "cycle.lhs:speed")
        cycle.add_balance("W", val=1.56, units="kg/s", eq_units="inch**2", rhs_name="area")
        self.connect("cycle.W", "inlet.Fl_I:stat:W")
        self.connect("nozzle.Throat:stat:area", "cycle.lhs:W")

    def _add_solver(self) -> None:
        newton = self.nonlinear_solver = om.NewtonSolver(solve_subsystems=True, max_sub_solves=100)
        newton.options["maxiter"] = MOST_ITERATIONS
        newton.options["atol"], newton.options["rtol"] = 1e-6, 1e-12  # a far start must not loosen what is reached
        newton.options["iprint"] = -1
        newton.options["reraise_child_analysiserror"] = False
        newton.options["err_on_non_converge"] = True
        newton.linesearch = om.ArmijoGoldsteinLS(bound_enforcement="scalar", iprint=-1)
        self.linear_solver = om.DirectSolver(assemble_jac=True)


class Engine(pyc.MPCycle):
    """The design point and one point off it, which is moved about."""

    def setup(self) -> None:
        self.pyc_add_pnt("DESIGN", Turboshaft(**TABULAR))
        self.pyc_add_pnt("OFF", Turboshaft(design=False, **TABULAR))
        self.set_input_defaults("DESIGN.gg_speed", SPEED, units="rpm")
        self.set_input_defaults("DESIGN.inlet.Fl_I:stat:W", 1.0, units="kg/s")
        self.pyc_connect_des_od("nozzle.Throat:stat:area", "cycle.area")
        for name in [f"{part}_loss.reference" for part in ("burner", "duct")]:
            self.pyc_connect_des_od(name, name)
        for name in [f"{part}.{scalar}" for part, scalars in SCALARS.items() for scalar in scalars]:
            self.pyc_connect_des_od(name, name)


def prepared(engine: dict[str, float]) -> om.Problem:
    """The problem with the numbers of the engine, at the guess of the design point."""
    problem = om.Problem(Engine(), reports=False)
    problem.setup()
    problem.set_solver_print(level=-1)
    for point in ("DESIGN", "OFF"):
        values = {
            "inlet.ram_recovery": 1.0 - engine["intake_loss"],
            "compressor.cooling:frac_W": engine["cooling_fraction"],
            "compressor.cooling:frac_P": 1.0,
            "compressor.cooling:frac_work": 1.0,
            "ggt.cooling:frac_P": 0.0,  # cooling air does no work: mixed in behind the turbine
            "burner_loss.level": engine["burner_loss"],
            "duct_loss.level": engine["duct_loss"],
            "gg_shaft.fracLoss": 1.0 - engine["gg_mechanical_efficiency"],
            "pt_shaft.fracLoss": 1.0 - engine["pt_mechanical_efficiency"],
            "nozzle.Cv": 1.0,
            "fc.MN": 1e-6,
        }
        for name, value in values.items():
            problem.set_val(f"{point}.{name}", value)
        # the shaft takes its loss from the turbine's torque, accessories included
        level = engine["accessory_power"] * engine["gg_mechanical_efficiency"] / SPEED
        problem.set_val(f"{point}.accessories.level", level, units="W/rpm")
        problem.set_val(f"{point}.pt_speed", SPEED, units="rpm")
    problem.set_val("DESIGN.inlet.Fl_I:stat:W", engine["air_flow"], units="kg/s")
    problem.set_val("DESIGN.compressor.PR", engine["pressure_ratio"])
    problem.set_val("DESIGN.compressor.eff", engine["compressor_efficiency"])
    problem.set_val("DESIGN.ggt.eff", engine["ggt_efficiency"])
    problem.set_val("DESIGN.cycle.demand", engine["turbine_inlet_temperature"], units="degK")
    problem.set_val("DESIGN.cycle.nozzle_PR", 1.0 + engine["exhaust_loss"])
    problem.set_val("DESIGN.cycle.power", engine["power"], units="W")
    return problem

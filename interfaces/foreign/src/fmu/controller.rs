//! A controller that is an FMU.

use super::calls::Fmu;
use super::calls::{Instance, WARNING};
use super::description::{Kind, Port};
use super::ports::{Map, Names, names_of, unconnected};
use super::running::{RunningFmu, parameters};
use crate::signals::{BRAKE_COMMAND, CLAMP_COMMAND, QUANTITIES, Quantity, torque_command};
use monorig_estimators::Vehicle;
use monorig_estimators::api::signals::{Command, MAX_DRIVES, Value};
use monorig_sim::closed_loop::registry::{BoxedController, ControllerType, NamedSettings, Refusal};
use monorig_sim::config::scenario::ControllerSettings;
use monorig_sim::control::{Controller, ControllerSetup, Perception, Reference};
use std::path::Path;

/// The controller of an FMU, with the names in the settings' map.
pub(crate) fn controller_of(
    path: &Path,
    settings: &ControllerSettings,
) -> Result<ControllerType, Refusal> {
    let fmu = Fmu::load(path)?;
    let map = settings.map.clone();
    // what `map` has wrong is told before anything is built
    Ports::find(fmu, &map)?;
    let open = unconnected(&fmu.description, &map, &input_names());
    let groups = parameters(fmu, path, "controller", &map, &open);
    let name = fmu.description.identifier.clone();
    let build = move |vehicle: &Vehicle, _: &ControllerSetup, set: NamedSettings<'_>| {
        let ports = Ports::find(fmu, &map)?;
        ports.drives(fmu, vehicle.drives)?;
        let open = unconnected(&fmu.description, &map, &input_names());
        let outputs = (ports.commands.clone(), Vec::new());
        let built = FmuController {
            running: RunningFmu::build(fmu, set, (&open, "measured_speed"), [], outputs)?,
            values: Vec::with_capacity(ports.references.len()),
            ports,
            steps: 0,
            broken: None,
        };
        Ok(Box::new(built) as BoxedController)
    };
    Ok(ControllerType::new(&name, groups, build))
}

/// Sources of the values of inputs.
type Number = Box<dyn Fn(&Reference, &Perception) -> f64 + Send>;
type Flag = Box<dyn Fn(&Perception) -> bool + Send>;

/// Numbers that a controller gets: name, unit, source.
fn numbers() -> Vec<(String, &'static str, Number)> {
    fn number(
        name: &str,
        unit: &'static str,
        source: fn(&Reference, &Perception) -> f64,
    ) -> (String, &'static str, Number) {
        (name.to_owned(), unit, Box::new(source))
    }
    let mut all = vec![
        number("reference_speed", "m/s", |r, _| r.speed_mps),
        number("reference_acceleration", "m/s²", |r, _| r.accel_mps2),
        number("reference_clamp_pressure", "MPa", |r, _| {
            r.clamp_pressure_mpa
        }),
        number("emergency_brake", "1", |r, _| r.emergency_brake),
        number("measured_speed", "m/s", |_, p| p.speed_mps),
        number("feedforward_grade", "rad", |_, p| p.grade_rad),
        number("feedforward_mass", "kg", |_, p| p.total_mass_kg),
    ];
    for i in 0..MAX_DRIVES {
        let slip = move |_: &Reference, p: &Perception| p.slip_mps[i];
        all.push((format!("slip[{}]", i + 1), "m/s", Box::new(slip)));
    }
    for q in &QUANTITIES {
        let [value, sd, _] = names_of(q.name);
        all.push((value, q.unit, Box::new(|_, p| estimated(q, p).value)));
        all.push((sd, q.unit, Box::new(|_, p| estimated(q, p).sd)));
    }
    all
}

/// Flags that a controller gets: name, source.
fn flags() -> Vec<(String, Flag)> {
    let mut all: Vec<(String, Flag)> = vec![(
        "feedforward_valid".to_owned(),
        Box::new(|p: &Perception| p.valid),
    )];
    for q in &QUANTITIES {
        let [_, _, valid] = names_of(q.name);
        all.push((valid, Box::new(|p| estimated(q, p).valid)));
    }
    all
}

/// A quantity of the estimator in the loop; 0 and not valid without one.
fn estimated(q: &Quantity, p: &Perception) -> Value {
    let mut estimate = p.estimate.unwrap_or_default();
    *(q.at)(&mut estimate)
}

fn input_names() -> Vec<String> {
    let numbers = numbers().into_iter().map(|n| n.0);
    numbers.chain(flags().into_iter().map(|f| f.0)).collect()
}

/// Place of an output in a command.
#[derive(Clone, Copy)]
enum Place {
    Torque(usize),
    Clamp,
    Brake,
}

/// Outputs that a controller may have: name, unit, place.
fn commands() -> Vec<(String, &'static str, Place)> {
    let torques = (0..MAX_DRIVES).map(|i| (torque_command(i), "N·m", Place::Torque(i)));
    let others = [
        (CLAMP_COMMAND.to_owned(), "MPa", Place::Clamp),
        (BRAKE_COMMAND.to_owned(), "1", Place::Brake),
    ];
    torques.chain(others).collect()
}

/// The variables of a controller that are set and got in a step.
struct Ports {
    /// Numbers that are set: references and sources.
    references: Vec<Port>,
    numbers: Vec<Number>,
    flags: Vec<(u32, Flag)>,
    /// Outputs that are got, their names and places.
    commands: Vec<Port>,
    places: Vec<(String, Place)>,
}

impl Ports {
    /// Finds the FMU's variables for monorig's inputs and outputs.
    fn find(fmu: &Fmu, map: &Map) -> Result<Self, Refusal> {
        let outputs = commands();
        let mut known: Vec<String> = outputs.iter().map(|c| c.0.clone()).collect();
        known.extend(input_names());
        let names = Names::new(fmu, map, &known, "a controller")?;
        let mut ports = Self {
            references: Vec::new(),
            numbers: Vec::new(),
            flags: Vec::new(),
            commands: Vec::new(),
            places: Vec::new(),
        };
        for (ours, unit, source) in numbers() {
            if let Some(v) = names.find(&ours, unit, ("input", Kind::Real))? {
                ports.references.push(v.port());
                ports.numbers.push(source);
            }
        }
        for (ours, source) in flags() {
            if let Some(v) = names.find(&ours, "1", ("input", Kind::Boolean))? {
                ports.flags.push((v.reference, source));
            }
        }
        for (ours, unit, place) in outputs {
            if let Some(v) = names.find(&ours, unit, ("output", Kind::Real))? {
                ports.commands.push(v.port());
                ports.places.push((ours, place));
            }
        }
        if ports.torques() == 0 {
            let first = torque_command(0);
            return Err(Refusal::new(
                format!("{} has no output `{first}`", fmu.at),
                format!(
                    "`map: {{\"{first}\": …}}` with one of its outputs: {}",
                    names.outputs()
                ),
            ));
        }
        Ok(ports)
    }

    /// Number of drive units, from the first on, with a torque.
    fn torques(&self) -> usize {
        let has = |i: &usize| {
            let mut places = self.places.iter();
            places.any(|(_, place)| matches!(place, Place::Torque(of) if of == i))
        };
        (0..MAX_DRIVES).take_while(has).count()
    }

    /// Refuses a train with a drive unit without a torque.
    fn drives(&self, fmu: &Fmu, drives: usize) -> Result<(), Refusal> {
        let torques = self.torques();
        if torques >= drives {
            return Ok(());
        }
        let missing = torque_command(torques);
        Err(Refusal::new(
            format!(
                "{} has no output `{missing}`, but the train has {drives} drive units",
                fmu.at
            ),
            format!("use `map: {{\"{missing}\": …}}`; several may name the same output"),
        ))
    }
}

/// An FMU in a run.
struct FmuController {
    running: RunningFmu,
    ports: Ports,
    /// Numbers of a step.
    values: Vec<f64>,
    /// Steps made.
    steps: u64,
    /// Reason why it cannot go on, if there is one.
    broken: Option<String>,
}

impl FmuController {
    /// Makes the step; the command is that at its end.
    fn step(&mut self, r: &Reference, p: &Perception, dt_s: f64) -> Result<Command, String> {
        self.values.clear();
        self.values
            .extend(self.ports.numbers.iter().map(|source| source(r, p)));
        self.steps += 1;
        let (ports, values) = (&self.ports, &self.values);
        let set = |fmu: &mut Instance| {
            let mut code = fmu.set_numbers(&ports.references, values);
            for (reference, source) in &ports.flags {
                if code <= WARNING {
                    code = code.max(fmu.set_boolean(*reference, source(p)));
                }
            }
            code
        };
        let now_s = self.steps as f64 * dt_s;
        let stepped = self.running.step(set, now_s, dt_s);
        stepped.map_err(|e| e.to_string())?;
        let mut command = r.command();
        for ((name, place), x) in self.ports.places.iter().zip(&self.running.numbers) {
            if !x.is_finite() {
                return Err(format!("{name} is {x}"));
            }
            match *place {
                Place::Torque(i) => command.motor_torque_nm[i] = *x,
                Place::Clamp => command.clamp_pressure_mpa = *x,
                Place::Brake => command.brake = *x,
            }
        }
        Ok(command)
    }
}

impl Controller for FmuController {
    fn control(&mut self, r: &Reference, p: &Perception, dt_s: f64) -> Command {
        self.step(r, p, dt_s).unwrap_or_else(|why| {
            self.broken = Some(why);
            r.command()
        })
    }

    fn broken(&self) -> Option<&str> {
        self.broken.as_deref()
    }
}

//! The plant of a scenario with its instruments: commands in, samples and truth out.

use super::interface::{Model, Stepped};
use crate::part::{PlantPart, measured, plant_alone};
use crate::variable::{Causality, Kind, Variable};
use monorig_estimators::api::signals::{Command, Measurements, Slot};
use monorig_plugin::signals;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::run::{Observer, StepFrame, Steps};
use monorig_sim::error::Error;
use monorig_sim::plant::Truth;
use monorig_sim::record::visit_truth;
use std::path::{Path, PathBuf};

struct PlantModel {
    file: PathBuf,
    set: Vec<(String, String)>,
    /// Outputs of each sample: the first of its values, after them its stamp.
    samples: Vec<(Slot, usize)>,
    drives: usize,
    /// Place of the first truth.
    truth: usize,
    seed: usize,
    run: Option<(Simulation, Steps)>,
}

fn build(file: &Path, set: &[(String, String)], seed: u64) -> Result<Simulation, Error> {
    plant_alone(file, set)?.build(seed)
}

pub(super) fn of(
    part: PlantPart,
    resources: &Path,
) -> Result<(Vec<Variable>, Box<dyn Model>), String> {
    let file = resources.join(&part.file);
    let mut simulation = build(&file, &part.set, 1).map_err(|e| e.to_string())?;
    // without a tool that commands the clamps they have the pressure of the scenario
    let clamp = Steps::default().look(&mut simulation).reference;
    let drives = simulation.vehicle.drives;
    let about = "Torque at the motor shaft.";
    let torques = (0..drives).map(signals::torque_command);
    let mut variables: Vec<Variable> = torques
        .map(|name| Variable::input(name, "N·m", about))
        .collect();
    let about = "Clamp cylinder pressure.";
    variables.push(Variable {
        start: clamp.clamp_pressure_mpa,
        ..Variable::input(signals::CLAMP_COMMAND.to_owned(), "MPa", about)
    });
    let about = "Share of the clamp-brake force, 0…1.";
    let brake = signals::BRAKE_COMMAND.to_owned();
    variables.push(Variable::input(brake, "1", about));
    let mut samples = Vec::new();
    for slot in measured(&simulation) {
        samples.push((slot, variables.len()));
        let about = slot.measurand.about();
        let values = signals::value_names(slot).into_iter();
        variables.extend(values.map(|name| Variable::output(name, slot.unit(), about)));
        let about = "Instant of the last sample; -1 before the first.";
        variables.push(Variable::output(signals::stamp_name(slot), "s", about));
    }
    let truth = variables.len();
    visit_truth(simulation.plant.truth(), &mut |column| {
        let name = column.path.to_string().replace('/', ".");
        variables.push(Variable::output(name, column.unit, column.doc));
    });
    let seed = variables.len();
    variables.push(Variable {
        kind: Kind::Integer,
        causality: Causality::Parameter,
        start: 1.0,
        range: Some([0.0, f64::from(i32::MAX)]),
        ..Variable::input(
            "seed".to_owned(),
            "1",
            "Seed of the errors of the instruments.",
        )
    });
    let model = PlantModel {
        file,
        set: part.set,
        samples,
        drives,
        truth,
        seed,
        run: None,
    };
    Ok((variables, Box::new(model)))
}

/// Writes the truth as outputs.
fn write_truth(values: &mut [f64], from: usize, truth: &Truth) {
    let mut places = values.iter_mut().skip(from);
    visit_truth(truth, &mut |column| {
        if let Some(to) = places.next() {
            *to = column.value;
        }
    });
}

/// Writes what a step brings as outputs.
struct Outputs<'a> {
    model: (&'a [(Slot, usize)], usize),
    values: &'a mut [f64],
    /// The last step of those that are made at once.
    last: bool,
}

impl Observer for Outputs<'_> {
    fn wants_truth(&self, _: i64) -> bool {
        self.last
    }
    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        let (samples, truth) = self.model;
        write_samples(self.values, samples, f.measurements);
        if self.last {
            write_truth(self.values, truth, f.truth);
        }
        Ok(())
    }
}

fn write_samples(values: &mut [f64], samples: &[(Slot, usize)], z: &Measurements) {
    for (slot, first) in samples {
        if let Some(sample) = slot.get(z) {
            let count = slot.measurand.shape().values();
            let all = sample.value.into_iter().take(count).chain([sample.t.s()]);
            let places = values.iter_mut().skip(*first);
            places.zip(all).for_each(|(to, x)| *to = x);
        }
    }
}

impl Model for PlantModel {
    fn begin(&mut self, values: &mut [f64]) -> Result<(), String> {
        let seed = values.get(self.seed).map_or(1, |x| *x as u64);
        let simulation = build(&self.file, &self.set, seed).map_err(|e| e.to_string())?;
        for (slot, first) in &self.samples {
            let stamp = first + slot.measurand.shape().values();
            let places = values.get_mut(*first..=stamp).unwrap_or_default();
            places.fill(0.0);
            if let Some(stamp) = places.last_mut() {
                *stamp = -1.0;
            }
        }
        write_truth(values, self.truth, simulation.plant.truth());
        self.run = Some((simulation, Steps::default()));
        Ok(())
    }

    fn step(&mut self, values: &mut [f64], t_s: f64, dt_s: f64) -> Result<Stepped, String> {
        let (simulation, steps) = self.run.as_mut().ok_or("the instance has not begun")?;
        let step_s = simulation.dt_s;
        let now_s = simulation.plant.truth().t_s;
        let count = (dt_s / step_s).round();
        if count < 1.0 || (count * step_s - dt_s).abs() > 1e-6 * step_s {
            let why = format!(
                "a step of {dt_s} s is not possible: the plant makes whole steps of {step_s} s"
            );
            return Ok(Stepped::NotMade(why));
        }
        if (t_s - now_s).abs() > 0.5 * step_s {
            let why = format!(
                "a step from {t_s} s is not possible: the plant is at {now_s} s and cannot go back"
            );
            return Ok(Stepped::NotMade(why));
        }
        let at = |place: usize| values.get(place).copied().unwrap_or_default();
        let mut command = Command::default();
        let torques = command.motor_torque_nm.iter_mut().take(self.drives);
        torques.enumerate().for_each(|(place, to)| *to = at(place));
        command.clamp_pressure_mpa = at(self.drives);
        command.brake = at(self.drives + 1);
        let count = count as u64;
        for made in 1..=count {
            let mut outputs = Outputs {
                model: (&self.samples, self.truth),
                values: &mut *values,
                last: made == count,
            };
            let over = steps.ended(simulation, &mut |_| true);
            if over.map_err(|e| e.to_string())?.is_some() {
                return Err(format!(
                    "the plant ends at {} s",
                    simulation.plant.truth().t_s
                ));
            }
            let seen = steps.look(simulation);
            steps
                .make(simulation, command, &seen, &mut [&mut outputs])
                .map_err(|e| e.to_string())?;
        }
        Ok(Stepped::Done)
    }

    fn save(&self) -> Option<Vec<u8>> {
        None
    }

    fn load(&mut self, _: &mut [f64], _: &[u8]) -> Result<(), String> {
        Err("the plant's state cannot be saved".to_owned())
    }
}

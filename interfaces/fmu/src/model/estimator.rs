//! An estimator: samples and commands in, its estimate out.

use super::interface::{Model, Stepped};
use crate::part::{EstimatorPart, LIBRARY, vehicle};
use crate::variable::{Causality, Kind, Variable, number};
use monorig_estimators::api::params::{Key, KeyKind, Setting};
use monorig_estimators::api::signals::{
    Command, Estimate, Measurand, Measurements, Sample, Shape, Slot,
};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Time, Vehicle};
use monorig_plugin::{loads_libraries, signals};
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, Refusal, Registry};
use monorig_sim::config::scenario::Settings;
use std::path::Path;

/// Inputs of a sample: the first of its values, and its stamp.
struct SampleInputs {
    slot: Slot,
    first: usize,
    stamp: usize,
    /// Stamp of the last sample, ns.
    last_ns: i64,
}

struct EstimatorModel {
    of_type: EstimatorType,
    vehicle: Vehicle,
    samples: Vec<SampleInputs>,
    /// Place of the first command.
    commands: usize,
    /// Place of the first output.
    outputs: usize,
    stamped: usize,
    /// The parameters from this place on.
    parameters: usize,
    keys: Vec<&'static Key>,
    estimator: Option<BoxedEstimator>,
    /// Time of the last step with a sample, s; `None` if it was the last step.
    waits_from_s: Option<f64>,
}

/// The variable of a parameter.
fn parameter(key: &'static Key) -> Variable {
    let named = Variable {
        causality: Causality::Parameter,
        ..Variable::input(key.name.to_owned(), "1", key.doc)
    };
    match key.kind {
        KeyKind::Number {
            unit,
            default,
            range,
        } => Variable {
            unit: if unit == "-" { "1" } else { unit },
            start: default.unwrap_or(f64::NAN),
            range: Some(range),
            ..named
        },
        KeyKind::Flag { default } => Variable {
            kind: Kind::Boolean,
            start: number(default),
            ..named
        },
        KeyKind::Choice { default, choices } => Variable {
            kind: Kind::Word(choices),
            start: place_of(default, choices),
            ..named
        },
    }
}

/// Number of a word, counted from 1; 0 for an unknown word.
fn place_of(word: &str, words: &[&str]) -> f64 {
    words
        .iter()
        .position(|w| *w == word)
        .map_or(0.0, |i| i as f64 + 1.0)
}

/// The type of a part.
fn type_of(part: &EstimatorPart, resources: &Path) -> Result<EstimatorType, Refusal> {
    let mut settings = Settings::of_type(&part.name);
    if part.in_library {
        settings = settings.in_library(&part.name, resources.join(LIBRARY));
    }
    loads_libraries(Registry::default()).estimator_of(&part.name, &settings)
}

pub(super) fn of(
    part: EstimatorPart,
    resources: &Path,
) -> Result<(Vec<Variable>, Box<dyn Model>), String> {
    let of_type = type_of(&part, resources).map_err(|w| w.to_string())?;
    let vehicle = vehicle(&part.vehicle)?;
    let mut variables = Vec::new();
    let mut samples = Vec::new();
    for name in &part.measured {
        let measurand = Measurand::named(name).ok_or(format!("no quantity is called `{name}`"))?;
        let count = match measurand.shape() {
            Shape::PerDrive => vehicle.drives,
            _ => 1,
        };
        for slot in measurand.slots().take(count) {
            let first = variables.len();
            let inputs = signals::value_names(slot).into_iter();
            variables.extend(inputs.map(|n| Variable::input(n, slot.unit(), measurand.about())));
            samples.push(SampleInputs {
                slot,
                first,
                stamp: variables.len(),
                last_ns: i64::MIN,
            });
            let about = "Instant of the sample; the value at the start means no sample.";
            variables.push(Variable {
                start: -1.0,
                ..Variable::input(signals::stamp_name(slot), "s", about)
            });
        }
    }
    let commands = variables.len();
    let about = "Commanded torque at the motor shaft.";
    let torques = (0..vehicle.drives).map(signals::torque_command);
    variables.extend(torques.map(|name| Variable::input(name, "N·m", about)));
    for (name, unit, about) in [
        (
            signals::CLAMP_COMMAND,
            "MPa",
            "Commanded clamp cylinder pressure.",
        ),
        (
            signals::BRAKE_COMMAND,
            "1",
            "Commanded share of the clamp-brake force.",
        ),
    ] {
        variables.push(Variable::input(name.to_owned(), unit, about));
    }
    let outputs = variables.len();
    for q in &signals::QUANTITIES {
        let name = q.name;
        variables.push(Variable::output(name, q.unit, q.about));
        let about = "Its standard deviation.";
        variables.push(Variable::output(format!("{name}_sd"), q.unit, about));
        let about = "True if the estimate can be used.";
        variables.push(Variable::flag(format!("{name}_valid"), about));
    }
    for (name, unit, about, _) in signals::NUMBERS {
        variables.push(Variable::output(name, unit, about));
    }
    for (name, _) in signals::FLAGS {
        variables.push(Variable::flag(name, "Status of the estimator."));
    }
    let about = "True if the last step was refused: the outputs are the previous outputs, marked not valid.";
    variables.push(Variable::flag(signals::REFUSED, about));
    let stamped = variables.len();
    let about = "If true, a sample is new when its stamp has changed; if false, every step brings all samples, at its end.";
    variables.push(Variable {
        causality: Causality::Parameter,
        ..Variable::flag(signals::STAMPED, about)
    });
    let keys: Vec<&'static Key> = of_type.keys().collect();
    let parameters = variables.len();
    for key in &keys {
        let mut variable = parameter(key);
        match (
            part.parameters.get(key.name).map(|v| v.setting()),
            variable.kind,
        ) {
            (Some(Setting::Number(x)), _) => variable.start = x,
            (Some(Setting::Flag(flag)), _) => variable.start = number(flag),
            (Some(Setting::Choice(word)), Kind::Word(words)) => {
                variable.start = place_of(word, words);
            }
            _ => {}
        }
        variables.push(variable);
    }
    let model = EstimatorModel {
        of_type,
        vehicle,
        samples,
        commands,
        outputs,
        stamped,
        parameters,
        keys,
        estimator: None,
        waits_from_s: None,
    };
    Ok((variables, Box::new(model)))
}

impl EstimatorModel {
    /// Builds the estimator with the present parameters.
    fn build(&mut self, values: &[f64]) -> Result<(), String> {
        let set = values.get(self.parameters..).unwrap_or_default();
        let mut settings: Vec<(&str, Setting<'_>)> = Vec::new();
        for (key, value) in self.keys.iter().zip(set) {
            let setting = match key.kind {
                KeyKind::Number { .. } if value.is_nan() => continue,
                KeyKind::Number { .. } => Setting::Number(*value),
                KeyKind::Flag { .. } => Setting::Flag(*value != 0.0),
                KeyKind::Choice { choices, .. } => {
                    let word = choices.get((*value as usize).wrapping_sub(1));
                    let Some(word) = word else {
                        return Err(format!(
                            "{} is {value} but must be 1…{}",
                            key.name,
                            choices.len()
                        ));
                    };
                    Setting::Choice(word)
                }
            };
            let checked = self.of_type.check(key.name, setting);
            checked.map_err(|w| format!("{}: {}", key.name, w.message))?;
            settings.push((key.name, setting));
        }
        let built = self.of_type.build(&self.vehicle, &settings);
        self.estimator = Some(built.map_err(|w| w.to_string())?);
        Ok(())
    }

    /// New samples and commands at `now`.
    fn read(&mut self, values: &[f64], now: Time) -> (Measurements, Command) {
        let at = |place: usize| values.get(place).copied().unwrap_or_default();
        let stamped = at(self.stamped) != 0.0;
        let mut z = Measurements::at(now);
        for sample in &mut self.samples {
            let t = match stamped {
                true => Time::from_s(at(sample.stamp)),
                false => now,
            };
            if t.ns() == sample.last_ns {
                continue;
            }
            sample.last_ns = t.ns();
            let mut value = [0.0; 3];
            let count = sample.slot.measurand.shape().values();
            let places = value.iter_mut().zip(sample.first..).take(count);
            places.for_each(|(to, place)| *to = at(place));
            sample.slot.set(&mut z, Some(Sample { t, value }));
        }
        let mut u = Command::default();
        let drives = self.vehicle.drives;
        let torques = u.motor_torque_nm.iter_mut().zip(self.commands..);
        torques.take(drives).for_each(|(to, place)| *to = at(place));
        u.clamp_pressure_mpa = at(self.commands + drives);
        u.brake = at(self.commands + drives + 1);
        (z, u)
    }

    /// Writes an estimate as the outputs.
    fn write(&self, values: &mut [f64], mut e: Estimate) {
        let mut outputs = values.iter_mut().skip(self.outputs);
        let mut put = |x: f64| {
            if let Some(to) = outputs.next() {
                *to = x;
            }
        };
        for q in &signals::QUANTITIES {
            let value = *(q.at)(&mut e);
            put(value.value);
            put(value.sd);
            put(number(value.valid));
        }
        signals::NUMBERS
            .iter()
            .for_each(|(.., at)| put(*at(&mut e)));
        signals::FLAGS
            .iter()
            .for_each(|(_, at)| put(number(*at(&mut e))));
        put(0.0);
    }

    /// Marks all outputs not valid, and the step refused.
    fn mark_refused(&self, values: &mut [f64]) {
        let valid = (0..signals::QUANTITIES.len()).map(|i| (3 * i + 2, 0.0));
        let refused = (self.stamped - self.outputs - 1, 1.0);
        for (place, x) in valid.chain([refused]) {
            if let Some(to) = values.get_mut(self.outputs + place) {
                *to = x;
            }
        }
    }
}

impl Model for EstimatorModel {
    fn begin(&mut self, values: &mut [f64]) -> Result<(), String> {
        self.build(values)?;
        self.waits_from_s = None;
        for sample in &mut self.samples {
            let stamp = values.get(sample.stamp).copied().unwrap_or_default();
            sample.last_ns = Time::from_s(stamp).ns();
        }
        self.write(values, Estimate::default());
        Ok(())
    }

    fn step(&mut self, values: &mut [f64], t_s: f64, dt_s: f64) -> Result<Stepped, String> {
        let (z, u) = self.read(values, Time::from_s(t_s + dt_s));
        if !z.any() {
            self.waits_from_s.get_or_insert(t_s);
            return Ok(Stepped::Done);
        }
        let dt = match self.waits_from_s.take() {
            Some(from_s) => t_s + dt_s - from_s,
            None => dt_s,
        };
        let estimator = self
            .estimator
            .as_mut()
            .ok_or("the instance has not begun")?;
        match estimator.step(&z, &u, dt) {
            Ok(estimate) => {
                self.write(values, estimate);
                Ok(Stepped::Done)
            }
            Err(Error::Broken(why)) => Err(why.to_string()),
            Err(why) => {
                self.mark_refused(values);
                Ok(Stepped::Refused(why.to_string()))
            }
        }
    }

    fn save(&self) -> Option<Vec<u8>> {
        let mut state = Vec::new();
        let waits = self.waits_from_s.unwrap_or(f64::NAN);
        state.extend(waits.to_le_bytes());
        let stamps = self.samples.iter().map(|s| s.last_ns);
        stamps.for_each(|ns| state.extend(ns.to_le_bytes()));
        if let Some(estimator) = &self.estimator {
            let room = match estimator.snapshot(&mut []) {
                Ok(room) | Err(SnapshotError::Room(room)) => room,
                Err(_) => return None,
            };
            let from = state.len();
            state.resize(from + room, 0);
            let used = estimator.snapshot(state.get_mut(from..)?).ok()?;
            state.truncate(from + used);
        }
        Some(state)
    }

    fn load(&mut self, values: &mut [f64], state: &[u8]) -> Result<(), String> {
        let torn = "the state has the wrong length";
        let mut rest = state;
        let mut next = || -> Option<[u8; 8]> {
            let (first, others) = rest.split_first_chunk()?;
            rest = others;
            Some(*first)
        };
        let waits = f64::from_le_bytes(next().ok_or(torn)?);
        let stamps: Option<Vec<i64>> = self
            .samples
            .iter()
            .map(|_| next().map(i64::from_le_bytes))
            .collect();
        self.build(values)?;
        if let Some(estimator) = &mut self.estimator {
            estimator.restore(rest).map_err(|why| why.to_string())?;
        }
        self.waits_from_s = (!waits.is_nan()).then_some(waits);
        let samples = self.samples.iter_mut().zip(stamps.ok_or(torn)?);
        samples.for_each(|(sample, ns)| sample.last_ns = ns);
        Ok(())
    }
}

//! Assignment of an FMU's variables to monorig's inputs and outputs, by name or by the `map` of the scenario. This file
//! has the ports of an estimator; the controller has its ports beside it.

use super::calls::Fmu;
use super::description::{BaseUnit, Description, Kind, Port, Variable};
use crate::signals::{self, FLAGS, NUMBERS, QUANTITIES};
use crate::unit;
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Slot, Value};
use monorig_sim::closed_loop::registry::Refusal;
use monorig_sim::config::scenario::ParameterValue;
use std::collections::BTreeMap;

/// Names in the FMU that replace monorig's names, and numbers that replace standard deviations.
pub(crate) type Map = BTreeMap<String, ParameterValue>;

/// Source of the value of an input.
#[derive(Clone, Copy)]
pub(crate) enum Source {
    Sample(Slot, usize),
    Stamp(Slot),
    Torque(usize),
    Clamp,
    Brake,
}

impl Source {
    /// Present value; `None` without a new sample.
    pub fn value(self, z: &Measurements, u: &Command) -> Option<f64> {
        match self {
            Self::Sample(slot, axis) => slot.get(z)?.value.get(axis).copied(),
            Self::Stamp(slot) => Some(slot.get(z)?.t.s()),
            Self::Torque(index) => u.motor_torque_nm.get(index).copied(),
            Self::Clamp => Some(u.clamp_pressure_mpa),
            Self::Brake => Some(u.brake),
        }
    }
}

/// One of our inputs: name, unit, source.
type Input = (String, &'static str, Source);

/// All inputs that there can be.
fn inputs() -> Vec<Input> {
    let mut all: Vec<Input> = Vec::new();
    for slot in Slot::all() {
        let names = signals::value_names(slot).into_iter().enumerate();
        all.extend(names.map(|(axis, name)| (name, slot.unit(), Source::Sample(slot, axis))));
        all.push((signals::stamp_name(slot), "s", Source::Stamp(slot)));
    }
    let drives = 0..monorig_estimators::api::signals::MAX_DRIVES;
    all.extend(drives.map(|i| (signals::torque_command(i), "N·m", Source::Torque(i))));
    all.push((signals::CLAMP_COMMAND.to_owned(), "MPa", Source::Clamp));
    all.push((signals::BRAKE_COMMAND.to_owned(), "1", Source::Brake));
    all
}

/// Place of a number in an estimate.
pub(crate) type NumberAt = Box<dyn Fn(&mut Estimate, f64) + Send>;
/// Place of a flag in an estimate.
pub(crate) type FlagAt = Box<dyn Fn(&mut Estimate, bool) + Send>;

/// The variables of an estimator that are set and got in a step.
#[derive(Default)]
pub(crate) struct EstimatorPorts {
    pub inputs: Vec<(Port, Source)>,
    pub numbers: Vec<Port>,
    pub numbers_at: Vec<NumberAt>,
    pub flags: Vec<u32>,
    pub flags_at: Vec<FlagAt>,
    /// Place of the mark that a step was refused, among the flags.
    pub refused: Option<usize>,
    /// The FMU's parameter that switches to samples with stamps.
    pub stamped: Option<u32>,
    /// Values that the FMU does not give in each step.
    pub start: Estimate,
    /// True if the FMU has no effective grade: the grade is then the effective grade.
    pub grade_is_effective: bool,
}

/// The variables of an FMU by name, and the map.
pub(crate) struct Names<'a> {
    pub at: &'a str,
    theirs: BTreeMap<&'a str, &'a Variable>,
    map: &'a Map,
}

impl<'a> Names<'a> {
    /// Makes the names of an FMU; refuses a map with names that we do not have, or with values that are no names.
    pub fn new(fmu: &'a Fmu, map: &'a Map, known: &[String], role: &str) -> Result<Self, Refusal> {
        for (ours, value) in map {
            if !known.contains(ours) {
                let message = format!(
                    "`map` has `{ours}`, which is neither an input nor an output of {role}"
                );
                let help = format!("one of {}", known.join(", "));
                return Err(Refusal::new(message, help));
            }
            // a standard deviation that is an output may be a number
            let sd = matches!(value, ParameterValue::Number(_))
                && QUANTITIES.iter().any(|q| *ours == format!("{}_sd", q.name))
                && role == ESTIMATOR;
            if !sd && !matches!(value, ParameterValue::Choice(_)) {
                let help = match role {
                    ESTIMATOR => {
                        "use the name of a variable of the FMU; a number only for a standard deviation"
                    }
                    _ => "use the name of a variable of the FMU",
                };
                return Err(Refusal::new(format!("`map` has no name for {ours}"), help));
            }
        }
        let theirs = fmu.description.variables.iter();
        Ok(Self {
            at: &fmu.at,
            theirs: theirs.map(|v| (v.name.as_str(), v)).collect(),
            map,
        })
    }

    /// Returns a sentence with the outputs of the FMU.
    pub fn outputs(&self) -> String {
        let outputs = self.theirs.values().filter(|v| v.causality == "output");
        let outputs: Vec<&str> = outputs.map(|v| v.name.as_str()).collect();
        outputs.join(", ")
    }

    /// Finds the variable for one of our names; `None` if the FMU has no such variable and the map does not name one.
    pub fn find(
        &self,
        ours: &str,
        unit: &str,
        wanted: (&str, Kind),
    ) -> Result<Option<&'a Variable>, Refusal> {
        let (causality, kind) = wanted;
        let mapped = match self.map.get(ours) {
            Some(ParameterValue::Choice(theirs)) => Some(theirs.as_str()),
            _ => None,
        };
        let name = mapped.unwrap_or(ours);
        let refuse = |message: String, help: String| {
            Err(Refusal::new(format!("{}: {message}", self.at), help))
        };
        let Some(v) = self.theirs.get(name) else {
            let those = self.theirs.values().filter(|v| v.causality == causality);
            let those: Vec<&str> = those.map(|v| v.name.as_str()).collect();
            return match mapped {
                None => Ok(None),
                Some(_) => refuse(
                    format!("`map` has `{name}` for {ours}, but the FMU has no such variable"),
                    format!("use one of its {causality}s: {}", those.join(", ")),
                ),
            };
        };
        if v.causality != causality {
            return refuse(
                format!("`{name}`, for {ours}, is of causality {}", v.causality),
                format!("a variable of causality {causality}"),
            );
        }
        // a whole number of the FMU is a number of ours; the FMU gets none but its own
        let fits = v.kind == kind
            || (kind == Kind::Real && v.kind == Kind::Integer && causality == "output");
        if v.is_array {
            return refuse(
                format!("`{name}`, for {ours}, is an array"),
                "an FMU with a variable of its own for each value".to_owned(),
            );
        }
        if !fits {
            let is = if kind == Kind::Real {
                "number (Real, Float64, Float32)"
            } else {
                "Boolean"
            };
            return refuse(
                format!("`{name}`, for {ours}, is not a {is}"),
                format!("a {is} of one value"),
            );
        }
        // what the FMU says, else the word that it uses
        let theirs = v
            .base
            .or_else(|| unit::named(v.unit.as_deref()?).map(BaseUnit::of));
        if let (Some(theirs), Some(known)) = (theirs, unit::find(unit).map(BaseUnit::of)) {
            let same = theirs.exponents == known.exponents
                && (theirs.factor / known.factor - 1.0).abs() < 1e-9
                && theirs.offset == 0.0;
            if !same {
                let is = v.unit.as_deref().unwrap_or_default();
                return refuse(
                    format!("`{name}` is in {is}, but {ours} is in {unit}"),
                    format!("a variable in {unit}"),
                );
            }
        }
        Ok(Some(v))
    }

    /// A number of the map in place of an output.
    fn number(&self, ours: &str) -> Option<f64> {
        match self.map.get(ours) {
            Some(ParameterValue::Number(x)) => Some(x.get()),
            _ => None,
        }
    }
}

/// Returns the inputs of an FMU to which none of our names is connected.
pub(crate) fn unconnected<'a>(
    description: &'a Description,
    map: &Map,
    ours: &[String],
) -> Vec<&'a Variable> {
    let mapped: Vec<&str> = map
        .values()
        .filter_map(|v| match v {
            ParameterValue::Choice(theirs) => Some(theirs.as_str()),
            _ => None,
        })
        .collect();
    let fed = |v: &Variable| {
        let by_name = ours.contains(&v.name) && !map.contains_key(&v.name);
        by_name || mapped.contains(&v.name.as_str())
    };
    let inputs = description
        .variables
        .iter()
        .filter(|v| v.causality == "input");
    inputs.filter(|v| !fed(v)).collect()
}

/// Role of an FMU in the loop, in messages.
const ESTIMATOR: &str = "an estimator";

/// Names of the inputs of an estimator.
pub(crate) fn estimator_inputs() -> Vec<String> {
    inputs().into_iter().map(|i| i.0).collect()
}

/// Names of an estimated quantity: its value, its standard deviation, its mark.
pub(crate) fn names_of(quantity: &str) -> [String; 3] {
    ["", "_sd", "_valid"].map(|part| format!("{quantity}{part}"))
}

impl EstimatorPorts {
    /// Finds the FMU's variables for monorig's inputs and outputs.
    pub fn find(fmu: &Fmu, map: &Map) -> Result<Self, Refusal> {
        let outputs = QUANTITIES.iter().flat_map(|q| names_of(q.name));
        let others = NUMBERS.iter().map(|n| n.0).chain(FLAGS.iter().map(|f| f.0));
        let others = others.chain([signals::REFUSED]).map(str::to_owned);
        let known: Vec<String> = outputs.chain(others).chain(estimator_inputs()).collect();
        let names = Names::new(fmu, map, &known, ESTIMATOR)?;
        let mut ports = Self::default();
        for (ours, unit, source) in inputs() {
            if let Some(v) = names.find(&ours, unit, ("input", Kind::Real))? {
                ports.inputs.push((v.port(), source));
            }
        }
        for q in &QUANTITIES {
            quantity(&mut ports, &names, q)?;
        }
        for (name, unit, _, place) in NUMBERS {
            if let Some(v) = names.find(name, unit, ("output", Kind::Real))? {
                ports.numbers.push(v.port());
                ports.numbers_at.push(Box::new(move |e, x| *place(e) = x));
            }
        }
        for (name, place) in FLAGS {
            if let Some(v) = names.find(name, "1", ("output", Kind::Boolean))? {
                ports.flags.push(v.reference);
                ports.flags_at.push(Box::new(move |e, x| *place(e) = x));
            }
        }
        if let Some(v) = names.find(signals::REFUSED, "1", ("output", Kind::Boolean))? {
            ports.refused = Some(ports.flags.len());
            ports.flags.push(v.reference);
            ports.flags_at.push(Box::new(|_, _| {}));
        }
        let stamped = names.theirs.get(signals::STAMPED);
        let stamped = stamped.filter(|v| v.causality == "parameter" && v.kind == Kind::Boolean);
        ports.stamped = stamped.map(|v| v.reference);
        Ok(ports)
    }
}

/// Value, standard deviation and mark of an estimated quantity.
fn quantity(
    ports: &mut EstimatorPorts,
    names: &Names<'_>,
    q: &'static signals::Quantity,
) -> Result<(), Refusal> {
    let (name, place) = (q.name, q.at);
    let value = names.find(name, q.unit, ("output", Kind::Real))?;
    let [_, sd_name, valid_name] = names_of(name);
    let sd = names.find(&sd_name, q.unit, ("output", Kind::Real))?;
    let valid = names.find(&valid_name, "1", ("output", Kind::Boolean))?;
    let Some(value) = value else {
        if name == "grade"
            && !names.theirs.contains_key("total_mass")
            && !names.map.contains_key("total_mass")
        {
            return Err(Refusal::new(
                format!("{} gives neither `total_mass` nor `grade`", names.at),
                format!(
                    "`map: {{grade: …}}` with one of its outputs: {}",
                    names.outputs()
                ),
            ));
        }
        ports.grade_is_effective |= name == "effective_grade";
        return Ok(());
    };
    ports.numbers.push(value.port());
    ports
        .numbers_at
        .push(Box::new(move |e, x| place(e).value = x));
    let constant = names.number(&sd_name);
    if let Some(sd) = sd {
        ports.numbers.push(sd.port());
        ports.numbers_at.push(Box::new(move |e, x| place(e).sd = x));
    }
    let known = sd.is_some() || constant.is_some();
    *place(&mut ports.start) = Value {
        value: 0.0,
        sd: constant.unwrap_or_default(),
        // an estimate whose accuracy nobody says is not fit for use
        valid: known && valid.is_none(),
    };
    if let Some(valid) = valid.filter(|_| known) {
        ports.flags.push(valid.reference);
        ports
            .flags_at
            .push(Box::new(move |e, x| place(e).valid = x));
    }
    Ok(())
}

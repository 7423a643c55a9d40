//! `modelDescription.xml` of an FMU, as far as a run needs it.

use crate::unit;
use monorig_sim::closed_loop::registry::Refusal;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use std::collections::BTreeMap;

/// The description, as far as a run needs it.
#[derive(Debug, Default)]
pub(crate) struct Description {
    /// FMI 3.0, not 2.0.
    pub three: bool,
    pub token: String,
    /// Name of the shared library, without its ending.
    pub identifier: String,
    pub one_at_a_time: bool,
    pub keeps_state: bool,
    /// Fixed step of an FMU, s.
    pub fixed_step_s: Option<f64>,
    pub variables: Vec<Variable>,
}

/// Type of a variable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Kind {
    Real,
    Integer,
    Boolean,
    /// One of several words.
    Word,
    /// A text, an array, a clock.
    #[default]
    Other,
}

/// Types of numbers as FMI 3.0 names them. FMI 2.0 has the first two, as Real and Integer.
pub(crate) const NUMBERS: [&str; 10] = [
    "Float64", "Int32", "Float32", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64",
];

/// A unit by exponents of kg, m, s, A, K, mol, cd, rad, its factor and its offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BaseUnit {
    pub exponents: [i32; 8],
    pub factor: f64,
    pub offset: f64,
}

impl BaseUnit {
    /// One of ours.
    pub fn of(u: &unit::Unit) -> Self {
        Self {
            exponents: [u.kg, u.m, u.s, 0, 0, 0, 0, u.rad],
            factor: u.factor,
            offset: 0.0,
        }
    }
}

/// A variable of an FMU.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variable {
    pub name: String,
    pub reference: u32,
    pub kind: Kind,
    /// Type of its number, by its place in [`NUMBERS`].
    pub number: usize,
    pub is_array: bool,
    pub causality: String,
    pub about: String,
    pub unit: Option<String>,
    /// Base units of the unit, if the FMU gives them.
    pub base: Option<BaseUnit>,
    /// Least and largest value.
    pub range: [Option<f64>; 2],
    /// Start value as text of the description.
    pub start: Option<String>,
    /// Words and their numbers.
    pub words: Vec<(String, i64)>,
    declared: Option<String>,
}

impl Variable {
    /// Its place and the type of its number.
    pub fn port(&self) -> Port {
        (self.reference, self.number)
    }
}

/// A number of an FMU: its reference, and the place of its type in [`NUMBERS`].
pub(crate) type Port = (u32, usize);

/// A type of the FMU, for its variables.
#[derive(Default)]
struct DeclaredType {
    unit: Option<String>,
    range: [Option<f64>; 2],
    words: Vec<(String, i64)>,
}

/// The description while it is read.
#[derive(Default)]
struct Reading {
    description: Description,
    co_simulation: bool,
    scheduled: bool,
    needs_tool: bool,
    variable_step: bool,
    step_s: Option<f64>,
    units: BTreeMap<String, BaseUnit>,
    unit: String,
    types: BTreeMap<String, DeclaredType>,
    of_type: String,
}

type Read<T> = Result<T, String>;

/// An attribute of an element.
fn attribute(e: &BytesStart<'_>, name: &str) -> Read<Option<String>> {
    let found = e.try_get_attribute(name).map_err(|e| e.to_string())?;
    let value = found.map(|a| {
        a.normalized_value(XmlVersion::Explicit1_0)
            .map(String::from)
    });
    value.transpose().map_err(|e| e.to_string())
}

/// An attribute as a number.
fn number<T: std::str::FromStr>(e: &BytesStart<'_>, name: &str) -> Read<Option<T>> {
    let Some(text) = attribute(e, name)? else {
        return Ok(None);
    };
    let number = text.trim().parse::<T>();
    number
        .map(Some)
        .map_err(|_| format!("{name}=\"{text}\" is not a number"))
}

/// An attribute that must be there.
fn needed<T>(found: Option<T>, e: &BytesStart<'_>, name: &str) -> Read<T> {
    let element = || String::from_utf8_lossy(e.name().as_ref()).into_owned();
    found.ok_or_else(|| format!("{} has no {name}", element()))
}

/// A flag, false where it is not.
fn flag(e: &BytesStart<'_>, name: &str) -> Read<bool> {
    Ok(matches!(attribute(e, name)?.as_deref(), Some("true" | "1")))
}

/// Type of a variable by the name of its element, and that of its number.
fn kind_of(element: &str, three: bool) -> Option<(Kind, usize)> {
    Some(match element {
        "Real" => (Kind::Real, 0),
        "Integer" => (Kind::Integer, 1),
        "Boolean" => (Kind::Boolean, 0),
        "Enumeration" => (Kind::Word, if three { 8 } else { 1 }),
        "String" | "Binary" | "Clock" => (Kind::Other, 0),
        _ => {
            let is_real = element.starts_with("Float");
            let kind = if is_real { Kind::Real } else { Kind::Integer };
            (kind, NUMBERS.iter().position(|n| *n == element)?)
        }
    })
}

impl Reading {
    /// An element that opens within others.
    fn element(&mut self, e: &BytesStart<'_>, within: &[String]) -> Read<()> {
        let name = String::from_utf8_lossy(e.name().as_ref()).into_owned();
        let parent = within.last().map_or("", String::as_str);
        let d = &mut self.description;
        match (parent, name.as_str()) {
            ("", "fmiModelDescription") => {
                let version = needed(attribute(e, "fmiVersion")?, e, "fmiVersion")?;
                d.three = version.starts_with("3.");
                if !d.three && !version.starts_with("2.") {
                    return Err(format!("it is of FMI {version}; help: FMI 2.0 or 3.0"));
                }
                let token = if d.three {
                    "instantiationToken"
                } else {
                    "guid"
                };
                d.token = needed(attribute(e, token)?, e, token)?;
            }
            ("", _) => {
                return Err(format!(
                    "it begins with <{name}> instead of <fmiModelDescription>"
                ));
            }
            ("fmiModelDescription", "CoSimulation") => {
                self.co_simulation = true;
                let identifier = attribute(e, "modelIdentifier")?;
                d.identifier = needed(identifier, e, "modelIdentifier")?;
                let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
                if !d.identifier.chars().all(plain) {
                    return Err(format!(
                        "its modelIdentifier `{}` is not a name in C; help: use letters, digits and _",
                        d.identifier
                    ));
                }
                d.one_at_a_time = flag(e, "canBeInstantiatedOnlyOncePerProcess")?;
                let state = if d.three { "State" } else { "state" };
                d.keeps_state = flag(e, &format!("canSerializeFMU{state}"))?;
                self.needs_tool = flag(e, "needsExecutionTool")?;
                self.variable_step = flag(e, "canHandleVariableCommunicationStepSize")?;
                self.step_s = number(e, "fixedInternalStepSize")?;
            }
            ("fmiModelDescription", "DefaultExperiment") => {
                self.step_s = self.step_s.or(number(e, "stepSize")?);
            }
            ("UnitDefinitions", "Unit") => self.unit = attribute(e, "name")?.unwrap_or_default(),
            ("Unit", "BaseUnit") => {
                let mut exponents = [0; 8];
                let names = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
                for (to, name) in exponents.iter_mut().zip(names) {
                    *to = number(e, name)?.unwrap_or(0);
                }
                let base = BaseUnit {
                    exponents,
                    factor: number(e, "factor")?.unwrap_or(1.0),
                    offset: number(e, "offset")?.unwrap_or(0.0),
                };
                self.units.insert(self.unit.clone(), base);
            }
            ("TypeDefinitions", _) => {
                self.of_type = attribute(e, "name")?.unwrap_or_default();
                self.types.entry(self.of_type.clone()).or_default();
                self.type_attributes(e)?;
            }
            ("SimpleType", _) => self.type_attributes(e)?,
            ("Enumeration" | "EnumerationType", "Item") => {
                let word = needed(attribute(e, "name")?, e, "name")?;
                let value = needed(number(e, "value")?, e, "value")?;
                let of_type = self.types.entry(self.of_type.clone()).or_default();
                of_type.words.push((word, value));
            }
            ("ModelVariables", _) => {
                let reference = number(e, "valueReference")?;
                d.variables.push(Variable {
                    name: needed(attribute(e, "name")?, e, "name")?,
                    reference: needed(reference, e, "valueReference")?,
                    causality: attribute(e, "causality")?.unwrap_or("local".into()),
                    about: attribute(e, "description")?.unwrap_or_default(),
                    ..Variable::default()
                });
                self.typed(e, &name)?;
            }
            ("ScalarVariable", _) => self.typed(e, &name)?,
            (_, "Dimension") => {
                if let Some(array) = d.variables.last_mut() {
                    (array.kind, array.is_array) = (Kind::Other, true);
                }
            }
            // of a text
            ("String" | "Binary", "Start") => {
                if let Some(text) = d.variables.last_mut() {
                    text.start = attribute(e, "value")?;
                }
            }
            ("fmiModelDescription", "ScheduledExecution") => self.scheduled = true,
            _ => {}
        }
        Ok(())
    }

    fn type_attributes(&mut self, e: &BytesStart<'_>) -> Read<()> {
        let of_type = self.types.entry(self.of_type.clone()).or_default();
        of_type.unit = attribute(e, "unit")?;
        of_type.range = [number(e, "min")?, number(e, "max")?];
        Ok(())
    }

    /// Takes the type of the last variable from an element.
    fn typed(&mut self, e: &BytesStart<'_>, element: &str) -> Read<()> {
        let three = self.description.three;
        let Some(v) = self.description.variables.last_mut() else {
            return Ok(());
        };
        let Some((kind, number_type)) = kind_of(element, three) else {
            return Ok(());
        };
        (v.kind, v.number) = (kind, number_type);
        v.unit = attribute(e, "unit")?;
        v.declared = attribute(e, "declaredType")?;
        v.start = attribute(e, "start")?;
        if matches!(kind, Kind::Real | Kind::Integer) {
            v.range = [number(e, "min")?, number(e, "max")?];
        }
        Ok(())
    }

    /// The description, once all is read.
    fn whole(self) -> Read<Description> {
        let mut d = self.description;
        if d.token.is_empty() {
            return Err("it has no fmiModelDescription".into());
        }
        if !self.co_simulation {
            let only = match self.scheduled {
                true => "scheduled execution",
                false => "model exchange",
            };
            return Err(format!(
                "it is for {only} only; help: export it for co-simulation"
            ));
        }
        if self.needs_tool {
            let help = "export it as a standalone FMU, with its solver inside";
            return Err(format!(
                "it needs the tool that made it (needsExecutionTool); help: {help}"
            ));
        }
        if !self.variable_step {
            let help = "export it for variable steps, or with a stepSize in DefaultExperiment";
            let step = self.step_s.filter(|s| *s > 0.0);
            let step = step.ok_or(format!(
                "it needs a fixed step size but does not state it; help: {help}"
            ))?;
            d.fixed_step_s = Some(step);
        }
        for v in &mut d.variables {
            if let Some(of_type) = v.declared.as_ref().and_then(|name| self.types.get(name)) {
                v.unit = v.unit.take().or(of_type.unit.clone());
                v.range = [0, 1].map(|i: usize| v.range[i].or(of_type.range[i]));
                v.words = of_type.words.clone();
            }
            let unit = v.unit.as_deref();
            v.base = unit.and_then(|unit| {
                self.units
                    .get(unit)
                    .copied()
                    .or_else(|| unit::find(unit).map(BaseUnit::of))
            });
        }
        let mut names: Vec<&str> = d.variables.iter().map(|v| v.name.as_str()).collect();
        names.sort_unstable();
        if let Some([name, _]) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("two of its variables are called `{name}`"));
        }
        Ok(d)
    }
}

/// Reads the description of the FMU that messages name `at`.
pub(crate) fn read(at: &str, xml: &[u8]) -> Result<Description, Refusal> {
    let mut reading = Reading::default();
    let mut position = 0;
    let all = (|| {
        let text = std::str::from_utf8(xml).map_err(|e| {
            position = e.valid_up_to();
            "it is not text in UTF-8".to_owned()
        })?;
        let mut reader = Reader::from_str(text);
        let mut within: Vec<String> = Vec::new();
        loop {
            position = usize::try_from(reader.buffer_position()).unwrap_or(0);
            match reader.read_event().map_err(|e| e.to_string())? {
                Event::Start(e) => {
                    reading.element(&e, &within)?;
                    within.push(String::from_utf8_lossy(e.name().as_ref()).into_owned());
                }
                Event::Empty(e) => reading.element(&e, &within)?,
                Event::End(_) => {
                    within.pop();
                }
                Event::Eof if within.is_empty() => break,
                Event::Eof => return Err(format!("it is cut off within <{}>", within.join("><"))),
                _ => {}
            }
        }
        reading.whole()
    })();
    all.map_err(|why| {
        let line = xml
            .get(..position)
            .map_or(1, |b| 1 + b.iter().filter(|c| **c == b'\n').count());
        let (message, help) = match why.split_once("; help: ") {
            Some((message, help)) => (message.to_owned(), help.to_owned()),
            None => (why, "use an FMU as exported by its tool".to_owned()),
        };
        Refusal::new(
            format!("{at}: modelDescription.xml, line {line}: {message}"),
            help,
        )
    })
}

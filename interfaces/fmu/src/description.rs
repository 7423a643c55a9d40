//! `modelDescription.xml` of an FMU.

use crate::Fmi;
use crate::variable::{Causality, Kind, TIME, Variable};
use monorig_plugin::unit;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::collections::BTreeSet;
use std::io::Result;

/// The description beside the variables.
pub(crate) struct ModelDescription<'a> {
    pub name: &'a str,
    pub about: &'a str,
    pub token: &'a str,
    /// Name of the shared library, without its ending.
    pub identifier: &'a str,
    pub keeps_state: bool,
    /// Step that importers propose, s.
    pub step_s: Option<f64>,
}

/// Attributes of an element, in their order.
type Attributes<'a> = Vec<(&'a str, String)>;

type Xml = Writer<Vec<u8>>;

fn empty(xml: &mut Xml, name: &str, attributes: Attributes<'_>) -> Result<()> {
    let attributes = attributes.iter().map(|(k, v)| (*k, v.as_str()));
    xml.create_element(name)
        .with_attributes(attributes)
        .write_empty()?;
    Ok(())
}

fn within(
    xml: &mut Xml,
    name: &str,
    attributes: Attributes<'_>,
    inner: impl FnOnce(&mut Xml) -> Result<()>,
) -> Result<()> {
    let attributes = attributes.iter().map(|(k, v)| (*k, v.as_str()));
    let element = xml.create_element(name).with_attributes(attributes);
    element.write_inner_content(inner)?;
    Ok(())
}

/// Writes the description.
pub(crate) fn write(
    model: &ModelDescription<'_>,
    variables: &[Variable],
    fmi: Fmi,
) -> Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let (version, token, state) = match fmi {
        Fmi::Two => ("2.0", "guid", "FMUstate"),
        Fmi::Three => ("3.0", "instantiationToken", "FMUState"),
    };
    let attributes = vec![
        ("fmiVersion", version.to_owned()),
        ("modelName", model.name.to_owned()),
        (token, model.token.to_owned()),
        ("description", model.about.to_owned()),
        (
            "generationTool",
            concat!("monorig ", env!("CARGO_PKG_VERSION")).to_owned(),
        ),
        ("variableNamingConvention", "structured".to_owned()),
    ];
    within(&mut xml, "fmiModelDescription", attributes, |xml| {
        let (get, serialize) = (
            format!("canGetAndSet{state}"),
            format!("canSerialize{state}"),
        );
        let keeps = model.keeps_state.to_string();
        let mut attributes = vec![
            ("modelIdentifier", model.identifier.to_owned()),
            ("canHandleVariableCommunicationStepSize", "true".to_owned()),
            (get.as_str(), keeps.clone()),
            (serialize.as_str(), keeps),
        ];
        if fmi == Fmi::Two {
            attributes.push(("canNotUseMemoryManagementFunctions", "true".to_owned()));
        }
        empty(xml, "CoSimulation", attributes)?;
        units(xml, variables)?;
        words(xml, variables, fmi)?;
        within(xml, "LogCategories", Vec::new(), |xml| {
            let names = ["logStatusWarning", "logStatusDiscard", "logStatusError"];
            let mut names = names.into_iter();
            names.try_for_each(|name| empty(xml, "Category", vec![("name", name.to_owned())]))
        })?;
        if let Some(step_s) = model.step_s {
            let attributes = vec![
                ("startTime", "0".to_owned()),
                ("stepSize", step_s.to_string()),
            ];
            empty(xml, "DefaultExperiment", attributes)?;
        }
        within(xml, "ModelVariables", Vec::new(), |xml| {
            if fmi == Fmi::Three {
                let attributes = vec![
                    ("name", "time".to_owned()),
                    ("valueReference", TIME.to_string()),
                    ("causality", "independent".to_owned()),
                    ("variability", "continuous".to_owned()),
                    ("unit", "s".to_owned()),
                ];
                empty(xml, "Float64", attributes)?;
            }
            let mut all = variables.iter().zip(1..);
            all.try_for_each(|(v, reference)| variable(xml, v, reference, fmi))
        })?;
        within(xml, "ModelStructure", Vec::new(), |xml| {
            structure(xml, variables, fmi)
        })
    })?;
    Ok(xml.into_inner())
}

/// The units that variables have.
fn units(xml: &mut Xml, variables: &[Variable]) -> Result<()> {
    let names: BTreeSet<&str> = variables.iter().map(|v| v.unit).chain(["s"]).collect();
    within(xml, "UnitDefinitions", Vec::new(), |xml| {
        for name in names.into_iter().filter(|name| *name != "1") {
            within(xml, "Unit", vec![("name", name.to_owned())], |xml| {
                let Some(u) = unit::find(name) else {
                    return Ok(());
                };
                let exponents = [("kg", u.kg), ("m", u.m), ("s", u.s), ("rad", u.rad)];
                let there = exponents.into_iter().filter(|(_, e)| *e != 0);
                let mut attributes: Attributes<'_> =
                    there.map(|(k, e)| (k, e.to_string())).collect();
                if u.factor != 1.0 {
                    attributes.push(("factor", u.factor.to_string()));
                }
                empty(xml, "BaseUnit", attributes)
            })?;
        }
        Ok(())
    })
}

/// Name of the type of a variable that is a word.
fn type_name(v: &Variable) -> String {
    format!("{}_words", v.name)
}

/// The types of variables that are words.
fn words(xml: &mut Xml, variables: &[Variable], fmi: Fmi) -> Result<()> {
    let all: Vec<(String, &[&str])> = variables
        .iter()
        .filter_map(|v| match v.kind {
            Kind::Word(words) => Some((type_name(v), words)),
            _ => None,
        })
        .collect();
    if all.is_empty() {
        return Ok(());
    }
    within(xml, "TypeDefinitions", Vec::new(), |xml| {
        for (name, words) in all {
            let items = |xml: &mut Xml| {
                let mut items = words.iter().zip(1..);
                items.try_for_each(|(word, value): (_, i32)| {
                    let attributes =
                        vec![("name", (*word).to_owned()), ("value", value.to_string())];
                    empty(xml, "Item", attributes)
                })
            };
            let named = vec![("name", name)];
            match fmi {
                Fmi::Two => within(xml, "SimpleType", named, |xml| {
                    within(xml, "Enumeration", Vec::new(), items)
                })?,
                Fmi::Three => within(xml, "EnumerationType", named, items)?,
            }
        }
        Ok(())
    })
}

/// A variable with its reference.
fn variable(xml: &mut Xml, v: &Variable, reference: u32, fmi: Fmi) -> Result<()> {
    let (causality, variability) = match v.causality {
        Causality::Parameter => ("parameter", "fixed"),
        Causality::Input => ("input", "continuous"),
        Causality::Output if v.kind == Kind::Real => ("output", "continuous"),
        Causality::Output => ("output", "discrete"),
    };
    let mut named = vec![
        ("name", v.name.clone()),
        ("valueReference", reference.to_string()),
        ("description", v.about.clone()),
        ("causality", causality.to_owned()),
        ("variability", variability.to_owned()),
    ];
    let mut typed: Attributes<'_> = Vec::new();
    if matches!(v.kind, Kind::Word(_)) {
        typed.push(("declaredType", type_name(v)));
    }
    if v.unit != "1" {
        typed.push(("unit", v.unit.to_owned()));
    }
    // one that is not set is outside of any range
    if let Some([least, most]) = v.range.filter(|_| !v.start.is_nan()) {
        typed.extend([("min", least.to_string()), ("max", most.to_string())]);
    }
    if v.causality != Causality::Output {
        let start = match v.kind {
            Kind::Boolean => (v.start != 0.0).to_string(),
            _ => v.start.to_string(),
        };
        typed.push(("start", start));
    }
    match fmi {
        Fmi::Two => {
            if v.causality == Causality::Parameter {
                named.push(("initial", "exact".to_owned()));
            }
            within(xml, "ScalarVariable", named, |xml| {
                let kind = match v.kind {
                    Kind::Real => "Real",
                    Kind::Integer => "Integer",
                    Kind::Boolean => "Boolean",
                    Kind::Word(_) => "Enumeration",
                };
                empty(xml, kind, typed)
            })
        }
        Fmi::Three => {
            let kind = match v.kind {
                Kind::Real => "Float64",
                Kind::Integer => "Int32",
                Kind::Boolean => "Boolean",
                Kind::Word(_) => "Enumeration",
            };
            named.extend(typed);
            empty(xml, kind, named)
        }
    }
}

/// The outputs, which are not known before the start either.
fn structure(xml: &mut Xml, variables: &[Variable], fmi: Fmi) -> Result<()> {
    let references = || {
        let outputs = variables.iter().zip(1..);
        let outputs = outputs.filter(|(v, _)| v.causality == Causality::Output);
        outputs.map(|(_, reference): (_, u32)| reference.to_string())
    };
    match fmi {
        Fmi::Two => ["Outputs", "InitialUnknowns"]
            .into_iter()
            .try_for_each(|name| {
                within(xml, name, Vec::new(), |xml| {
                    references().try_for_each(|r| empty(xml, "Unknown", vec![("index", r)]))
                })
            }),
        Fmi::Three => ["Output", "InitialUnknown"]
            .into_iter()
            .try_for_each(|name| {
                references().try_for_each(|r| empty(xml, name, vec![("valueReference", r)]))
            }),
    }
}

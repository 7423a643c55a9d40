//! `monorig list`: all names of a kind, each with its unit, its range and one sentence; all runs.

mod runs;

use crate::arguments::Out;
use crate::command::{Command, CommandOutcome, Program};
use crate::files::folders::yaml_files;
use crate::files::formats::{self, FileKind};
use crate::files::share;
use crate::ui::errors::CliError;
use crate::ui::output;
use clap::ValueEnum;
use monorig_estimators::api::params::{Key, KeyKind};
use monorig_lab::bound;
use monorig_lab::metrics::METRICS;
use monorig_logs::map::faults_of_logs;
use monorig_sim::closed_loop::registry::{Refusal, Registry};
use monorig_sim::config::file::{Document, input_error};
use monorig_sim::config::scenario::{FaultKind, Scenario};
use monorig_sim::record::{descriptions, palette};
use serde_json::Value;
use std::path::Path;

const LIST_EXAMPLES: &str = "\
Examples:
  monorig list estimators
  monorig list parameters dffrls_aekf_robust     unit, range and default of each
  monorig list metrics
  monorig list scenarios scenarios/harsh
  monorig list runs
      the runs in runs/ (or in MONORIG_OUT); one with an @ in its name is a
      variant: below it stands what was changed against the scenario file";

/// Widest line.
const WIDTH: usize = 80;

/// List estimators, parameters, metrics, channels, scenarios, runs …
#[derive(Debug, clap::Parser)]
#[command(name = "list", after_help = LIST_EXAMPLES)]
pub struct ListArgs {
    /// Names to list
    pub what: Listed,
    /// Estimator, folder or part of a name: with `parameters` the estimator or controller; with `scenarios` and `runs`
    /// the folder [default: scenarios, the folder for results]; with the other lists a part of the name
    pub of: Option<String>,
    /// List only names with this text
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    pub filter: String,
    #[command(flatten)]
    pub out: Out,
}

/// Lists that the command can print.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Listed {
    /// Types of estimators
    Estimators,
    /// Types of controllers
    Controllers,
    /// Parameters of an estimator or controller
    Parameters,
    /// Metrics, as in `expect`
    Metrics,
    /// Columns of channels.parquet
    Channels,
    /// Faults of sensors
    Faults,
    /// Instruments of a sensor data sheet
    Sensors,
    /// Scenarios in a folder
    Scenarios,
    /// Runs in the folder for results, with the changes of each variant
    Runs,
}

/// A name, the text beside it (unit, range), and a sentence.
struct Entry {
    name: String,
    values: String,
    sentence: String,
}

impl Command for ListArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        list(self, program.registry)
    }
}

/// Print the list.
fn list(task: &ListArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let entries = match task.what {
        Listed::Estimators => {
            // ours first
            let mut types: Vec<_> = registry.estimators().iter().collect();
            types.sort_by_key(|t| palette::place(t.name()));
            let types = types.into_iter();
            types.map(|t| named(t.name(), t.description())).collect()
        }
        Listed::Controllers => {
            let types = registry.controllers().iter();
            types.map(|t| named(t.name(), t.description())).collect()
        }
        Listed::Parameters => parameters(task.of.as_deref(), registry)?,
        Listed::Metrics => METRICS
            .iter()
            .map(|m| entry(m.name, unit(m.unit), m.doc))
            .collect(),
        Listed::Channels => descriptions()
            .iter()
            .chain(&bound::descriptions())
            .map(|c| entry(&c.path, unit(c.unit), c.doc))
            .collect(),
        Listed::Faults => faults(),
        Listed::Sensors => sensors(registry),
        Listed::Scenarios => scenarios(task.of.as_deref().unwrap_or("scenarios"))?,
        Listed::Runs => {
            let folder = task.of.as_ref().map_or_else(|| task.out.get(), Into::into);
            return runs::list(&folder, &task.filter);
        }
    };
    let part = match task.what {
        Listed::Parameters | Listed::Scenarios => "",
        _ => task.of.as_deref().unwrap_or_default(),
    };
    let parts = [part, &task.filter];
    let found = (entries.iter()).filter(|entry| parts.iter().all(|p| entry.name.contains(p)));
    let text: String = found.map(text).collect();
    let part = parts
        .into_iter()
        .rfind(|p| !p.is_empty())
        .unwrap_or_default();
    if text.is_empty() && !part.is_empty() {
        let message = format!("there is no name with `{part}` in this list");
        return Err(CliError::refused(
            message,
            "leave the text out to see all names",
        ));
    }
    output::print(&text)?;
    Ok(CommandOutcome::Held)
}

fn parameters(of: Option<&str>, registry: &Registry) -> Result<Vec<Entry>, CliError> {
    let refused = |refusal: Refusal| CliError::refused(refusal.message, refusal.help);
    let Some(name) = of else {
        let help = "name an estimator: `monorig list parameters dffrls_aekf_robust`; `monorig list estimators` has the names";
        return Err(CliError::refused(
            "`parameters` needs the name of an estimator, controller, instrument or plant",
            help,
        ));
    };
    let controllers = registry.controllers().iter();
    let instruments = registry.instruments().iter();
    let plants = registry.plants().iter();
    let mut others = (controllers.map(|t| (t.name(), t.keys().collect::<Vec<_>>())))
        .chain(instruments.map(|t| (t.name(), t.keys().collect())))
        .chain(plants.map(|t| (t.name(), t.keys().collect())));
    let keys: Vec<&Key> = match others.find(|(other, _)| *other == name) {
        Some((_, keys)) => keys,
        None => {
            let of_type = registry.find_estimator(name).map_err(refused)?;
            of_type.keys().collect()
        }
    };
    Ok(keys.into_iter().map(parameter).collect())
}

fn parameter(key: &Key) -> Entry {
    let default = match (key.default(), key.kind) {
        (Some(value), _) => format!("default {value}"),
        (None, _) => "default: derived from the vehicle".to_owned(),
    };
    let range = match key.kind {
        KeyKind::Number {
            unit: u,
            range: [low, high],
            ..
        } => format!(
            "{low}…{high}{}",
            if u == "-" {
                String::new()
            } else {
                format!(" {u}")
            }
        ),
        KeyKind::Flag { .. } => "true or false".to_owned(),
        KeyKind::Choice { choices, .. } => format!("one of {}", choices.join(", ")),
    };
    entry(key.name, format!("{range}; {default}"), key.doc)
}

fn faults() -> Vec<Entry> {
    let schema = serde_json::to_value(schemars::schema_for!(FaultKind)).unwrap_or_default();
    let all = schema["oneOf"].as_array().cloned().unwrap_or_default();
    let of_rig = all.iter().map(|fault| {
        let text = |key: &str| fault[key].as_str().unwrap_or_default().to_owned();
        let name = text("const");
        let kind = serde_json::from_value::<FaultKind>(Value::String(name.clone()));
        let size = match kind.is_ok_and(FaultKind::needs_size) {
            true => "needs `size`",
            false => "",
        };
        entry(&name, size.into(), &text("description"))
    });
    let of_logs = faults_of_logs().into_iter();
    let of_logs = of_logs
        .map(|(name, text)| entry(&name, "only in maps of logs; needs `size`".into(), &text));
    of_rig.chain(of_logs).collect()
}

fn sensors(registry: &Registry) -> Vec<Entry> {
    let Some(format) = formats::row(FileKind::Sensors) else {
        return Vec::new();
    };
    let schema = Value::from(format.schema(registry));
    let properties = schema["properties"].as_object().cloned();
    let instruments = properties.unwrap_or_default().into_iter();
    let of_sheet = instruments
        .filter(|(_, property)| property.get("anyOf").is_some())
        .map(|(name, property)| {
            let doc = property["description"].as_str().unwrap_or_default();
            named(&name, doc)
        });
    let own = registry.instruments().iter();
    let own = own.map(|t| named(t.name(), t.description()));
    of_sheet.chain(own).collect()
}

/// Scenarios in a folder and its subfolders, each with its purpose.
fn scenarios(named_so: &str) -> Result<Vec<Entry>, CliError> {
    let folder = &*share::find(named_so.into());
    if !folder.is_dir() {
        let help = "name a folder of scenarios: `monorig list scenarios DIR`";
        return Err(input_error(folder, "", "this is not a folder", help).into());
    }
    let mut entries = Vec::new();
    for file in yaml_files(folder)? {
        let is_scenario = Document::read(&file)
            .ok()
            .and_then(|d| formats::recognise(&d.keys()))
            .is_some_and(|format| format.kind == FileKind::Scenario);
        if is_scenario {
            let why = match Scenario::load(&file, &[]) {
                Ok(scenario) => scenario.file.why,
                Err(_) => "cannot be used; `monorig check` says why".into(),
            };
            // as a command takes it, also where it comes with the program
            let shown = Path::new(named_so).join(file.strip_prefix(folder).unwrap_or(&file));
            entries.push(named(&shown.display().to_string(), &why));
        }
    }
    Ok(entries)
}

fn named(name: &str, sentence: &str) -> Entry {
    entry(name, String::new(), sentence)
}

fn entry(name: &str, values: String, sentence: &str) -> Entry {
    Entry {
        name: name.to_owned(),
        values,
        sentence: sentence.to_owned(),
    }
}

fn unit(unit: &str) -> String {
    match unit {
        "" | "-" => String::new(),
        unit => format!("[{unit}]"),
    }
}

/// The name with unit and range, and below these the sentence in lines that fit the width.
fn text(entry: &Entry) -> String {
    let head = format!("{}  {}", entry.name, entry.values);
    let lines = |words: &str, first: &str| {
        let words: Vec<&str> = words.split_whitespace().collect();
        let options = textwrap::Options::new(WIDTH).break_words(false);
        let options = options.word_splitter(textwrap::WordSplitter::NoHyphenation);
        let options = options.word_separator(textwrap::WordSeparator::AsciiSpace);
        let options = options.wrap_algorithm(textwrap::WrapAlgorithm::FirstFit);
        let options = options.initial_indent(first).subsequent_indent("    ");
        textwrap::fill(&words.join(" "), options)
    };
    let below = Some(lines(&entry.sentence, "    ")).filter(|text| !text.trim().is_empty());
    let all = std::iter::once(lines(&head, "")).chain(below);
    all.map(|text| text + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_the_terminal() {
        let sentence = "word ".repeat(60);
        let shown = text(&entry("a_name", "[kg]".into(), &sentence));
        assert!(shown.lines().all(|l| l.chars().count() <= WIDTH), "{shown}");
        assert!(shown.starts_with("a_name [kg]\n    word"), "{shown}");
        assert_eq!(
            shown.split_whitespace().filter(|w| *w == "word").count(),
            60
        );
    }

    #[test]
    fn every_fault_has_a_sentence_and_says_whether_it_needs_a_size() {
        let faults = faults();
        assert!(faults.len() > 5 && faults.iter().all(|f| !f.sentence.is_empty()));
        let of = |name: &str| faults.iter().find(|f| f.name == name).unwrap();
        assert_eq!(of("drift").values, "needs `size`");
        assert_eq!(of("off").values, "");
    }

    #[test]
    fn every_instrument_estimator_and_metric_is_listed() {
        let registry = Registry::default();
        let names: Vec<String> = sensors(&registry).into_iter().map(|e| e.name).collect();
        for name in ["accelerometer", "gyro", "wheel_speed", "motor_torque"] {
            assert!(names.iter().any(|n| n == name), "{name}");
        }
        for estimator in registry.estimators() {
            assert!(!estimator.description().is_empty(), "{}", estimator.name());
            let all = parameters(Some(estimator.name()), &registry).unwrap();
            assert!(
                all.iter()
                    .all(|p| !p.sentence.is_empty() && !p.values.is_empty())
            );
        }
        assert!(METRICS.iter().all(|m| !m.doc.is_empty()));
    }

    #[test]
    fn a_misspelt_estimator_is_told() {
        let told = parameters(Some("dffrls_aekf_robst"), &Registry::default());
        assert!(told.err().unwrap().to_string().contains("did you mean"));
        assert!(parameters(None, &Registry::default()).is_err());
    }
}

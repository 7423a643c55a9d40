//! Read-out: speed, slope and mass of truth and estimators as a table, once a second.

use crate::colours;
use crate::series::estimators;
use crate::stream::{MessageStream, entity, send, times};
use monorig_sim::error::Error;
use monorig_sim::record::{Channel, Chunk};
use re_sdk_types::archetypes::TextDocument;
use std::fmt::Write;

/// Least time between two read-outs, ns.
const PERIOD_NS: i64 = 1_000_000_000;

/// The table and its columns.
pub struct Readout {
    chainage: Option<usize>,
    rows: Vec<Row>,
    next_ns: i64,
}

/// A line of the table.
struct Row {
    name: String,
    cells: [Cell; 3],
}

/// A value, its standard deviation and its validity.
struct Cell {
    value: Option<usize>,
    sd: Option<usize>,
    valid: Option<usize>,
    scale: f64,
    digits: usize,
}

impl Readout {
    /// Makes the readout from the channels of a run; the truth of a recorded drive is the reference of its log.
    pub fn new(channels: &[Channel], recorded: bool) -> Self {
        let find = |path: String| channels.iter().position(|c| c.path == path);
        let cell = |path: &str, scale, digits| Cell {
            value: find(path.to_owned()),
            sd: find(format!("{path}_sd")),
            valid: find(format!("{path}_valid")),
            scale,
            digits,
        };
        let deg = 180.0 / std::f64::consts::PI;
        let row = |name: &str, [speed, slope, mass]: [String; 3]| Row {
            name: name.to_owned(),
            cells: [
                cell(&speed, 1.0, 2),
                cell(&slope, deg, 2),
                cell(&mass, 1e-3, 2),
            ],
        };
        let truth = ["speed", "grade_at_imu", "total_mass"].map(|leaf| format!("truth/{leaf}"));
        let first = if recorded { "reference" } else { "truth" };
        let mut rows = vec![row(first, truth)];
        for name in &estimators(channels) {
            let paths = ["speed", "grade", "total_mass"];
            let paths = paths.map(|leaf| format!("estimates/{name}/{leaf}"));
            // with many estimators the plots have no legends
            rows.push(row(&format!("{name} ({})", colours::name(name)), paths));
        }
        Self {
            chainage: find("truth/chainage".into()),
            rows,
            next_ns: i64::MIN,
        }
    }

    /// The read-outs of a chunk.
    pub fn log(&mut self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        let (mut ns, mut texts) = (Vec::new(), Vec::new());
        for (row, &t) in chunk.time_ns.iter().enumerate() {
            if t < self.next_ns {
                continue;
            }
            self.next_ns = t.saturating_add(PERIOD_NS);
            ns.push(t);
            texts.push(self.text(chunk, row));
        }
        if ns.is_empty() {
            return Ok(());
        }
        let media = vec!["text/markdown"; texts.len()];
        let columns = TextDocument::update_fields()
            .with_many_text(texts)
            .with_many_media_type(media)
            .columns_of_unit_batches();
        send(stream, entity(["readout"]), times(ns), columns)
    }

    fn text(&self, chunk: &Chunk, row: usize) -> String {
        let at = |channel: Option<usize>| {
            let column = channel.and_then(|c| chunk.values.get(c));
            column
                .and_then(|c| c.get(row).copied())
                .filter(|x| x.is_finite())
        };
        let mut text = String::new();
        let place = at(self.chainage).map_or(String::new(), |m| format!(", chainage {m:.1} m"));
        let seconds = chunk.time_ns[row] as f64 * 1e-9;
        // writing to a string does not fail
        let _ = write!(
            text,
            "t = {seconds:.0} s{place}\n\n| | speed m/s | slope ° | mass t |\n|-|-|-|-|\n"
        );
        for line in &self.rows {
            let _ = write!(text, "| {} |", line.name);
            for cell in &line.cells {
                let digits = cell.digits;
                let _ = match (at(cell.value), at(cell.sd), at(cell.valid)) {
                    (Some(_), _, Some(valid)) if valid != 1.0 => write!(text, " not valid |"),
                    (Some(x), Some(sd), _) => {
                        let (x, sd) = (x * cell.scale, 2.0 * sd * cell.scale);
                        write!(text, " {x:.digits$} ± {sd:.digits$} |")
                    }
                    (Some(x), None, _) => write!(text, " {:.digits$} |", x * cell.scale),
                    (None, _, _) => write!(text, " – |"),
                };
            }
            text.push('\n');
        }
        text.push_str("\n± 2 standard deviations\n");
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_says_what_is_not_valid_and_what_is_not_there() {
        let channels = [
            ("truth/speed", "m/s"),
            ("truth/total_mass", "kg"),
            ("estimates/e/total_mass", "kg"),
            ("estimates/e/total_mass_sd", "kg"),
            ("estimates/e/total_mass_valid", "1"),
        ]
        .map(|(path, unit)| Channel {
            path: path.into(),
            unit,
        });
        let chunk = Chunk {
            time_ns: vec![0, 2_000_000_000],
            values: vec![
                vec![1.0; 2],
                vec![20e3; 2],
                vec![21e3; 2],
                vec![500.0; 2],
                vec![1.0, 0.0],
            ],
            ..Chunk::default()
        };
        let readout = Readout::new(&channels, false);
        let valid = readout.text(&chunk, 0);
        assert!(valid.contains("| truth | 1.00 | – | 20.00 |"), "{valid}");
        let colour = colours::name("e");
        assert!(
            valid.contains(&format!("| e ({colour}) | – | – | 21.00 ± 1.00 |")),
            "{valid}"
        );
        let not = readout.text(&chunk, 1);
        let row = format!("| e ({colour}) | – | – | not valid |");
        assert!(not.contains(&row), "{not}");
    }
}

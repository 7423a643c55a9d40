//! Reports: one HTML file that needs nothing else, with plots as SVG inside it.
//!
//! A [`page::Page`] is a list of sections; a section holds text, [`table::Table`]s and figures. A figure comes from
//! one of the kinds in [`crate::reports::plot`], all used alike: fill a struct with numbers, call `figure()`. Numbers
//! that are not finite are left out; a plot without any says "no data". The same numbers give the same bytes.
//!
//! ```
//! use monorig_lab::reports::page::{Page, Section};
//! use monorig_lab::reports::plot::{axis::Axis, line::{Line, LineChart}, theme::Ink};
//!
//! let mut chart = LineChart::new("Speed", Axis::linear("time, s"), Axis::linear("speed, m/s"));
//! chart.add(Line::new("train", Ink::Series(0), vec![(0.0, 0.0), (1.0, 0.5)]));
//! let mut page = Page::new("One run");
//! page.sections.push(Section::new("Motion").figure(chart.figure()));
//! assert!(page.to_html().contains("speed, m/s"));
//! ```

mod findings;
pub mod html;
pub mod page;
pub mod pair;
mod parameters;
pub mod plot;
pub mod run;
pub mod stress;
pub mod study;
pub mod table;

/// Help for a user who named a file or folder without a report.
const TAKES: &str = "name one of these:
    the folder of a run, such as runs/minimal/1, or two of them
    a file that `monorig test --json FILE` or `monorig compare --json FILE` wrote
    the results of a study, such as runs/vehicle_test_spread/results.jsonl
  `monorig tune` writes its own report: report.html beside its results";

//! The report of a recording: a table of all columns, the Allan deviation of each, keys for a sensor sheet.

use super::{ColumnFit, short};
use crate::reports::page::{Block, Page, Section};
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Line, LineChart};
use crate::reports::plot::theme::Ink;
use crate::reports::table::{Cell, Table};

/// Titles of the figures of a column, after its name; units are those of the column.
pub const FIGURES: [&str; 11] = [
    "unit",
    "samples",
    "Hz",
    "mean",
    "spread of means",
    "sd",
    "white noise, unit·√s",
    "density, unit/√Hz",
    "instability",
    "random walk, unit/√s",
    "rms > 2 Hz",
];

/// The figures of a column in this order; a dash for a missing figure.
pub fn figures(fit: &ColumnFit) -> Vec<String> {
    let or_dash = |x: Option<f64>| match x.filter(|x| x.is_finite()) {
        Some(x) => short(x),
        None => "–".into(),
    };
    let noise = fit.noise.as_ref();
    vec![
        fit.unit.clone(),
        fit.samples.to_string(),
        short(fit.rate_hz),
        short(fit.mean),
        or_dash(Some(fit.spread_of_means())),
        short(fit.sd),
        or_dash(noise.map(|n| n.white)),
        or_dash(noise.map(|n| n.density())),
        or_dash(noise.and_then(|n| n.instability)),
        or_dash(noise.and_then(|n| n.random_walk)),
        or_dash(fit.vibration.as_ref().map(|v| v.rms)),
    ]
}

/// The page.
pub fn page(title: &str, fits: &[ColumnFit]) -> Page {
    let mut page = Page::new(format!("Instruments in {title}"));
    page.subtitle = "Overlapping Allan deviation, and keys for a sensor sheet. The recording contains the instrument and the motion of its mount: \
        only at standstill is the noise the noise of the instrument."
        .into();
    let mut table = Table::new(&["column", "unit"], &FIGURES[1..]);
    for fit in fits {
        let cells = figures(fit).into_iter().map(Cell::from);
        table.row([Cell::from(fit.name.clone())].into_iter().chain(cells));
    }
    let mut all = Section::new("Figures").table(table);
    for fit in fits {
        all = all.figure(chart(fit).figure());
    }
    page.sections.push(all);
    page.sections.push(vibrations(fits));
    let mut keys = Section::new("Keys for a sensor sheet").text(
        "Paste these keys below `errors:` of an instrument. `noise_density` is the same white noise in the other convention: give one of the two. \
         A mean is a bias only if the signal should be zero; the mean of an accelerometer includes gravity and tilt.",
    );
    for fit in fits {
        let block = Block::Folded(fit.name.clone(), fit.sheet_keys());
        keys.blocks.push(block);
    }
    page.sections.push(keys);
    page
}

fn chart(fit: &ColumnFit) -> LineChart {
    let with_unit = |what: &str| match fit.unit.as_str() {
        "" => what.to_owned(),
        unit => format!("{what}, {unit}"),
    };
    let mut chart = LineChart::new(
        fit.name.clone(),
        Axis::log("averaging time τ, s"),
        Axis::log(with_unit("Allan deviation")),
    );
    let points = fit.allan.iter().map(|p| (p.tau_s, p.deviation)).collect();
    chart.add(Line::new("recording", Ink::series(0), points).dotted());
    if let Some(noise) = &fit.noise {
        let fitted =
            |of: &dyn Fn(f64) -> f64| fit.allan.iter().map(|p| (p.tau_s, of(p.tau_s))).collect();
        let line = fitted(&|tau| noise.deviation(tau));
        chart.add(Line::new("fit", Ink::series(1), line));
        let white = fitted(&|tau| noise.white / tau.sqrt());
        chart.add(Line::new("white noise", Ink::Muted, white).faintly());
        chart.note = format!(
            "White noise falls with the root of τ. The fit is off by {:.0} % (root mean square){}",
            100.0 * noise.misfit,
            match noise.misfit {
                m if m > 0.2 => ": the recording contains more than noise of an instrument.",
                _ => ".",
            }
        );
    }
    chart
}

fn vibrations(fits: &[ColumnFit]) -> Section {
    let mut table = Table::new(
        &["column"],
        &[
            "rms > 2 Hz",
            "without hits",
            "10 % of power below, Hz",
            "90 % of power below, Hz",
            "hits per s",
            "10 % of hits below",
            "90 % of hits below",
        ],
    );
    for fit in fits {
        if let Some(v) = &fit.vibration {
            let numbers = [
                v.rms,
                v.robust_sd,
                v.band_hz[0],
                v.band_hz[1],
                v.hits_per_s,
                v.hit_size[0],
                v.hit_size[1],
            ];
            let cells = numbers.map(|x| {
                let text = if x.is_finite() {
                    short(x)
                } else {
                    "–".into()
                };
                Cell::from(text)
            });
            table.row([Cell::from(fit.name.clone())].into_iter().chain(cells));
        }
    }
    Section::new("Above 2 Hz")
        .text(
            "Root mean square, 1.4826 times the median magnitude (which rare hits hardly change), the band with the middle 80 % of the power, and peaks \
             above five such deviations.",
        )
        .table(table)
}

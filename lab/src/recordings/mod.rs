//! Recordings of real instruments: what noise, bias and vibration is in them, in the keys of a sensor sheet.
//!
//! | file | what it holds |
//! |---|---|
//! | `pieces` | columns over time, in pieces without gap |
//! | [`allan`] | overlapping Allan deviation |
//! | [`noise_fit`] | white noise, bias instability and random walk fitted to it |
//! | `vibration` | what is above 2 Hz: level, band, hits |
//! | [`page`] | the report |

pub mod allan;
pub mod noise_fit;
pub mod page;
mod pieces;
pub(crate) mod vibration;

use allan::AllanPoint;
use noise_fit::NoiseFit;
pub use pieces::{RecordedRow, Recording};
use vibration::Vibration;

/// Figures of one column, in its SI unit.
#[derive(Clone, Debug)]
pub struct ColumnFit {
    /// Name of the column.
    pub name: String,
    /// SI unit.
    pub(crate) unit: String,
    /// Number of samples.
    pub(crate) samples: usize,
    /// Samples per second, Hz.
    pub(crate) rate_hz: f64,
    /// Mean of each piece.
    pub means: Vec<f64>,
    /// Mean of all samples.
    pub(crate) mean: f64,
    /// Standard deviation within the pieces.
    pub(crate) sd: f64,
    /// Overlapping Allan deviation.
    pub(crate) allan: Vec<AllanPoint>,
    /// Noise fitted to it; `None` with too few points.
    pub noise: Option<NoiseFit>,
    /// Vibration above 2 Hz; `None` at 5 samples a second and below.
    pub vibration: Option<Vibration>,
}

impl ColumnFit {
    /// Standard deviation of the pieces' means; NaN of a single piece.
    pub(crate) fn spread_of_means(&self) -> f64 {
        let n = self.means.len() as f64;
        let mean = self.means.iter().sum::<f64>() / n;
        (self.means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
    }

    /// The figures as keys of a sensor sheet, to be pasted below `errors:`.
    pub fn sheet_keys(&self) -> String {
        let mut keys = vec![format!("bias: {}", short(self.mean))];
        if self.means.len() > 1 {
            keys.push(format!("bias_sd: {}", short(self.spread_of_means())));
        }
        if let Some(noise) = &self.noise {
            keys.push(format!("random_walk_of_integral: {}", short(noise.white)));
            if let (Some(sd), Some(time_s)) = (noise.instability, noise.instability_s) {
                keys.push(format!(
                    "gauss_markov: {{sd: {}, time_s: {}}}",
                    short(sd),
                    short(time_s)
                ));
            }
            if let Some(walk) = noise.random_walk {
                keys.push(format!("bias_random_walk: {}", short(walk)));
            }
        }
        if let Some(v) = self.vibration.as_ref().filter(|v| v.colours()) {
            keys.push(format!(
                "vibration: {{sd: {}, full_mps: SPEED, band_hz: [{}, {}]}}",
                short(v.robust_sd),
                short(v.band_hz[0]),
                short(v.band_hz[1])
            ));
        }
        keys.join("\n")
    }
}

/// Three significant digits, as YAML reads them.
pub(crate) fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.2e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-3..1e5).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Noise, bias and vibration of every column of a recording.
pub fn fit(recording: &Recording) -> Vec<ColumnFit> {
    (0..recording.names.len())
        .map(|i| {
            let pieces: Vec<&[f64]> = recording
                .pieces
                .iter()
                .map(|p| p.columns[i].as_slice())
                .collect();
            let period_s = recording.period_s();
            let samples: usize = pieces.iter().map(|p| p.len()).sum();
            let means: Vec<f64> = pieces.iter().map(|p| mean(p)).collect();
            let squares: f64 = pieces
                .iter()
                .zip(&means)
                .flat_map(|(p, m)| p.iter().map(move |x| (x - m).powi(2)))
                .sum();
            let allan = allan::overlapping(&pieces, period_s);
            ColumnFit {
                name: recording.names[i].clone(),
                unit: recording.units[i].clone(),
                samples,
                rate_hz: 1.0 / period_s,
                mean: pieces.iter().map(|p| p.iter().sum::<f64>()).sum::<f64>() / samples as f64,
                sd: (squares / samples as f64).sqrt(),
                means,
                noise: noise_fit::fit(&allan),
                vibration: vibration::find(&pieces, 1.0 / period_s),
                allan,
            }
        })
        .collect()
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

//! Vibration of a recording above 2 Hz: level, band, hits.
//!
//! The high-pass is a Butterworth filter of fourth order (two bilinear biquads), run forwards and backwards, so that
//! peaks keep their height and place; at its corner a quarter of the power is left. The band is where 10 % and 90 %
//! of the power above 2 Hz are below: the power above f is that behind a high-pass at f. Hits are peaks above five
//! robust deviations (1.4826 times the median magnitude, which rare peaks leave as it is), 0.2 s apart.

use std::f64::consts::PI;

const FROM_HZ: f64 = 2.0;
/// Quality factors of the two halves of a Butterworth filter of fourth order.
const QUALITIES: [f64; 2] = [0.541_196_100_146_197, 1.306_562_964_876_376_5];
/// Least height of a peak, robust deviations.
const PEAK: f64 = 5.0;
/// Least time between two peaks, s.
const APART_S: f64 = 0.2;

/// Level and band of the signal above 2 Hz, in the unit of the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Vibration {
    /// Root mean square above 2 Hz.
    pub(crate) rms: f64,
    /// 1.4826 times the median magnitude: the deviation without the hits.
    pub robust_sd: f64,
    /// Frequencies below which 10 % and 90 % of the power above 2 Hz lie, Hz.
    pub band_hz: [f64; 2],
    /// Highest frequency in the recording, Hz: half the sampling rate.
    pub(crate) nyquist_hz: f64,
    /// Hits per second.
    pub(crate) hits_per_s: f64,
    /// 10 % and 90 % quantile of their size; NaN without hits.
    pub(crate) hit_size: [f64; 2],
}

impl Vibration {
    /// True for a vibration. White noise has 10 % to 90 % of its power spread over the whole range.
    pub fn colours(&self) -> bool {
        let range = self.nyquist_hz - FROM_HZ;
        self.band_hz[1] - self.band_hz[0] < 0.6 * range
    }
}

/// Vibration in pooled pieces; `None` below 5 samples a second or without a piece of half a second.
pub(crate) fn find(pieces: &[&[f64]], rate_hz: f64) -> Option<Vibration> {
    if rate_hz <= 5.0 {
        return None;
    }
    let above = |f: f64| -> Vec<Vec<f64>> {
        pieces
            .iter()
            .filter(|p| p.len() as f64 >= 0.5 * rate_hz)
            .map(|p| high_passed(p, f / rate_hz))
            .collect()
    };
    let power = |x: &[Vec<f64>]| {
        let count: usize = x.iter().map(Vec::len).sum();
        x.iter().flatten().map(|v| v * v).sum::<f64>() / count as f64
    };
    let high = above(FROM_HZ);
    let total = power(&high);
    if !(total.is_finite() && total > 0.0) {
        return None;
    }
    let share = |f: f64| power(&above(f)) / total;
    let mut magnitudes: Vec<f64> = high.iter().flatten().map(|x| x.abs()).collect();
    magnitudes.sort_by(f64::total_cmp);
    let robust_sd = 1.4826 * magnitudes[magnitudes.len() / 2];
    let mut hits: Vec<f64> = high
        .iter()
        .flat_map(|x| peaks(x, PEAK * robust_sd, (APART_S * rate_hz) as usize))
        .collect();
    hits.sort_by(f64::total_cmp);
    let seconds = magnitudes.len() as f64 / rate_hz;
    let quantile = |q: f64| match hits.len() {
        0 => f64::NAN,
        n => hits[(q * (n - 1) as f64).round() as usize],
    };
    let nyquist_hz = 0.5 * rate_hz;
    Some(Vibration {
        rms: total.sqrt(),
        robust_sd,
        band_hz: [0.9, 0.1].map(|wanted| crossing(&share, wanted, nyquist_hz)),
        nyquist_hz,
        hits_per_s: hits.len() as f64 / seconds,
        hit_size: [quantile(0.1), quantile(0.9)],
    })
}

/// Frequency above which this share of the power lies, by bisection.
fn crossing(share: &impl Fn(f64) -> f64, wanted: f64, nyquist_hz: f64) -> f64 {
    let (mut low, mut high) = (FROM_HZ, 0.98 * nyquist_hz);
    for _ in 0..12 {
        let middle = (low * high).sqrt();
        if share(middle) > wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low * high).sqrt()
}

/// The samples after a high-pass at `corner` (share of the sampling rate), without its settling time at both ends: half
/// a second of 2 Hz, at most an eighth of the samples each.
fn high_passed(x: &[f64], corner: f64) -> Vec<f64> {
    let settle = ((1.0 / corner.max(1e-9)) as usize).min(x.len() / 8);
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let mut y: Vec<f64> = x.iter().map(|v| v - mean).collect();
    for _ in 0..2 {
        QUALITIES.iter().for_each(|q| biquad(&mut y, corner, *q));
        y.reverse();
    }
    y.truncate(y.len() - settle);
    y.split_off(settle)
}

/// Second-order high-pass by the bilinear transform (Bristow-Johnson, "Cookbook formulae for audio EQ biquad filter
/// coefficients").
fn biquad(x: &mut [f64], corner: f64, q: f64) {
    let (sin, cos) = (2.0 * PI * corner).sin_cos();
    let alpha = sin / (2.0 * q);
    let scale = 1.0 / (1.0 + alpha);
    let (b0, b1) = (0.5 * (1.0 + cos) * scale, -(1.0 + cos) * scale);
    let (a1, a2) = (-2.0 * cos * scale, (1.0 - alpha) * scale);
    let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
    for value in x {
        let out = b0 * *value + b1 * x1 + b0 * x2 - a1 * y1 - a2 * y2;
        (x2, x1) = (x1, *value);
        (y2, y1) = (y1, out);
        *value = out;
    }
}

/// Heights of local maxima of the magnitude above `least`, the higher of two nearer than `apart` samples.
fn peaks(x: &[f64], least: f64, apart: usize) -> Vec<f64> {
    let mut found: Vec<(usize, f64)> = Vec::new();
    for (i, w) in x.windows(3).enumerate() {
        let [a, b, c] = [w[0], w[1], w[2]].map(f64::abs);
        if b < least || b < a || b <= c {
            continue;
        }
        match found.last_mut() {
            Some(last) if i - last.0 < apart => {
                if b > last.1 {
                    *last = (i, b);
                }
            }
            _ => found.push((i, b)),
        }
    }
    found.into_iter().map(|(_, height)| height).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_sim::sensors::noise::White;
    use monorig_sim::sensors::stream::Stream;

    fn sine(f: f64, rate: f64, seconds: f64) -> Vec<f64> {
        (0..(seconds * rate) as usize)
            .map(|k| 3.0 + (2.0 * PI * f * k as f64 / rate).sin())
            .collect()
    }

    /// Well above the corner a sine of amplitude 1 has 1/√2, well below nothing; at the corner a quarter of the power
    /// is left.
    #[test]
    fn the_level_is_that_of_what_is_above_2_hz() {
        for (f, rms) in [(10.0, 0.5_f64.sqrt()), (2.0, 0.125_f64.sqrt()), (0.3, 0.0)] {
            let x = sine(f, 100.0, 100.0);
            let found = find(&[&x], 100.0).unwrap();
            assert!(
                (found.rms - rms).abs() < 0.02 * rms + 3e-3,
                "{f} Hz: {found:?}"
            );
        }
    }

    #[test]
    fn the_band_lies_about_a_tone_and_spreads_over_white_noise() {
        let tone = find(&[&sine(9.0, 100.0, 60.0)], 100.0).unwrap();
        assert!(tone.band_hz[0] > 6.0 && tone.band_hz[1] < 13.0, "{tone:?}");
        assert!(tone.colours());
        let mut white = White::new(0.5, 0.0, Stream::new(2, "w"));
        let x: Vec<f64> = (0..20_000).map(|_| white.draw(0.0)).collect();
        let found = find(&[&x], 100.0).unwrap();
        assert!(!found.colours(), "{found:?}");
        // 96 % of the power is above 2 of 50 Hz.
        assert!((found.rms / (0.5 * 0.96_f64.sqrt()) - 1.0).abs() < 0.02);
        assert!((found.robust_sd / found.rms - 1.0).abs() < 0.03);
        assert_eq!(found.hits_per_s, 0.0);
    }

    #[test]
    fn hits_are_counted_and_leave_the_robust_deviation_as_it_is() {
        let mut white = White::new(0.1, 0.0, Stream::new(3, "w"));
        let x: Vec<f64> = (0..30_000)
            .map(|k| white.draw(0.0) + if k % 300 == 150 { 5.0 } else { 0.0 })
            .collect();
        let found = find(&[&x], 100.0).unwrap();
        assert!((found.hits_per_s - 1.0 / 3.0).abs() < 0.01, "{found:?}");
        assert!((found.robust_sd / 0.1 - 1.0).abs() < 0.1, "{found:?}");
        assert!(
            found.hit_size[0] > 3.5 && found.hit_size[1] < 6.0,
            "{found:?}"
        );
    }

    #[test]
    fn too_slow_a_recording_has_none() {
        assert!(find(&[&sine(1.0, 4.0, 100.0)], 4.0).is_none());
    }
}

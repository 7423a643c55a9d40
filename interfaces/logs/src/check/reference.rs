//! Checks of the reference slope against specific force and wheels: its time, sign and unit.

use super::lag::Shifted;
use super::verdict::{Check, Verdict, check};
use crate::identify::{
    ForceWindow, MIN_WINDOWS, Parameter, Windows, diluted, parameters, regression,
};
use crate::map::Map;
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_sim::error::Error;
use nalgebra::Vector2;

/// Largest lag, s; how much more must be unexplained without it, and by how many standard deviations that must be more
/// than chance, of values that are independent after so long, s.
const MAX_LAG_S: f64 = 0.5;
const MIN_RATIO: f64 = 1.2;
const SDS: f64 = 3.0;
const INDEPENDENT_S: f64 = 3.0;
/// Least correlation at the lag.
const MIN_CORRELATION: f64 = 0.6;
/// Gain of the slope by the instruments on the reference; a lean of the box is a part of it.
const GAIN: [f64; 2] = [0.75, 1.33];
/// Largest standard deviation of a gain that is seen.
const MAX_GAIN_SD: f64 = 0.15;

/// Finds the parameters of a log, and describes further parameters and what the log lacks for them. A reference that is
/// late, or of a wrong sign or unit, is an error.
pub fn identify(map: &Map) -> Result<(Vec<Parameter>, Vec<String>), Error> {
    parameters(map, |balance, slope_sd| {
        let mut all = reference(balance, slope_sd).into_iter();
        all.find_map(|c| match c.verdict {
            Verdict::Bad(why) => Some((format!("{}: {:.3} {}", c.what, c.value, c.unit), why)),
            _ => None,
        })
    })
}

/// All of them, where the log shows both slopes; `slope_sd` is the standard deviation of the reference, rad.
pub(crate) fn reference(balance: &Windows, slope_sd: f64) -> Vec<Check> {
    let by_force = |w: &ForceWindow| (w.specific_force[0] - w.acceleration) / G;
    let windows = balance.windows.iter();
    let known: Vec<&ForceWindow> = windows
        .filter(|w| by_force(w).is_finite() && w.sin.is_finite())
        .collect();
    let hops = known.iter().zip(known.iter().skip(1));
    let hop_s = hops
        .map(|(a, b)| b.t_s - a.t_s)
        .fold(f64::INFINITY, f64::min);
    let mut shifted = Shifted::new(hop_s);
    for piece in known.chunk_by(|a, b| b.t_s - a.t_s < 1.5 * hop_s) {
        let of = |f: &dyn Fn(&ForceWindow) -> f64| piece.iter().map(|w| f(w)).collect::<Vec<_>>();
        shifted.add(&of(&by_force), &of(&|w| w.sin));
    }
    let mut all = Vec::new();
    let lag = shifted.lag().filter(|l| l.correlation >= MIN_CORRELATION);
    let late = lag.filter(|l| {
        let ratio = l.unexplained_ratio();
        let chance = ratio.ln() * l.covered_s / INDEPENDENT_S;
        l.lag_s.abs() > MAX_LAG_S && ratio > MIN_RATIO && chance > SDS * SDS
    });
    let what = "lag of the reference slope against specific force and wheels";
    let range = format!("-{MAX_LAG_S} to {MAX_LAG_S}");
    match (late, lag) {
        (Some(l), _) => {
            let why = format!(
                "`clocks: {{FILE: {{offset_s: {:.1}}}}}` of its file",
                -l.lag_s
            );
            all.push(check(what, l.lag_s, "s", &range, Verdict::Bad(why)));
            return all;
        }
        (_, Some(l)) if l.lag_s.abs() <= MAX_LAG_S => {
            all.push(check(what, l.lag_s, "s", &range, Verdict::Good));
        }
        _ => {}
    }
    let rows: Vec<_> = known
        .iter()
        .map(|w| (w.t_s, Vector2::new(w.sin, 1.0), by_force(w)))
        .collect();
    let fit = regression(&rows, MIN_WINDOWS, balance.longest_s);
    let diluted = diluted(known.iter().map(|w| w.sin), slope_sd);
    let Some((gain, sd)) = fit
        .map(|f| (f.value[0], f.sd[0].hypot(diluted)))
        .filter(|g| g.1 < MAX_GAIN_SD)
    else {
        return all;
    };
    let [low, high] = GAIN;
    let verdict = match gain {
        g if g + 2.0 * sd > low && g - 2.0 * sd < high => Verdict::Good,
        g if g < 0.0 => Verdict::Bad("the sign is wrong: + is uphill".into()),
        g if (0.5..0.65).contains(&g) => Verdict::Bad("0.57: the reference is in %".into()),
        g if (1.6..1.9).contains(&g) => Verdict::Bad("1.75: the reference is in degrees".into()),
        _ => Verdict::Bad("check the unit of the reference, or its columns".into()),
    };
    let what = "gain of the slope by specific force and wheels on the reference slope";
    all.push(check(what, gain, "", &format!("{low} to {high}"), verdict));
    all
}

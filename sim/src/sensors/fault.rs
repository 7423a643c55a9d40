//! Faults by event: off, dropouts, stuck, bias, drift, wrong scale, noise, spikes, coarse steps, wrong units and axes.
//!
//! Bias, drift, scale, noise, spikes and steps act on the sensed value, before quantisation and saturation: a fault
//! cannot read beyond the range. Wrong units, signs and axes are mistakes of the receiver and act behind it; off,
//! dropouts and stuck act on what is handed over. A fault holds for stamps from ≤ t < to, on one axis or on all. Its
//! random draws come from a stream of its own, so that a fault leaves the noise of the run as it was.

use super::stream::Stream;

/// Share of samples that a spike hits while the fault `spikes` lasts.
pub const SPIKE_PROBABILITY: f64 = 0.02;

/// A fault of a sensor. `unit` is that of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// No samples.
    Off,
    /// This share of the samples is lost.
    Dropouts(f64),
    /// The last value repeated.
    Stuck,
    /// A constant bias, unit.
    Bias(f64),
    /// A bias that grows at this rate, unit/s.
    Drift(f64),
    /// Values multiplied by a factor.
    Scale(f64),
    /// White noise of this standard deviation, unit.
    Noise(f64),
    /// Rare outliers of this height, unit.
    Spikes(f64),
    /// Values rounded to multiples of this step, unit.
    Quantised(f64),
    /// Zero within this band around zero, and values beyond it reduced by the band, unit.
    DeadBand(f64),
    /// Values that follow with play: only what moves by more than this is seen, unit.
    Hysteresis(f64),
    /// Values read in another unit than their own.
    WrongUnit(WrongUnit),
    /// Values of the wrong sign.
    WrongSign,
    /// Two axes exchanged, by index.
    AxesSwapped([usize; 2]),
}

/// Values in a unit that is not the SI unit they are read as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrongUnit {
    /// km/h for m/s.
    KmPerH,
    /// g for m/s².
    G,
    /// Degrees for radians, also per second.
    Degrees,
}

impl WrongUnit {
    /// SI unit of the values that can be misread.
    pub fn si_units(self) -> &'static [&'static str] {
        match self {
            Self::KmPerH => &["m/s"],
            Self::G => &["m/s²"],
            Self::Degrees => &["rad", "rad/s"],
        }
    }

    /// Number in the wrong unit of a value of 1 in the SI unit.
    pub fn factor(self) -> f64 {
        match self {
            Self::KmPerH => 3.6,
            Self::G => 1.0 / 9.80665,
            Self::Degrees => 180.0 / std::f64::consts::PI,
        }
    }
}

/// A fault of a sensor and its time interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultWindow {
    /// From, s.
    pub from_s: f64,
    /// Until, s; infinite = to the end.
    pub to_s: f64,
    /// The fault.
    pub fault: Fault,
    /// Index of the faulty axis; none = all.
    pub axis: Option<usize>,
}

/// All faults of one sensor of `N` axes.
#[derive(Clone, Debug)]
pub struct Faults<const N: usize> {
    windows: Vec<FaultWindow>,
    stream: Stream,
    /// Last value delivered before the sensor stuck.
    last: Option<[f64; N]>,
}

impl<const N: usize> Faults<N> {
    /// No faults yet.
    pub fn new(seed: u64, name: &str) -> Self {
        Self {
            windows: Vec::new(),
            stream: Stream::new(seed, &format!("{name}/fault")),
            last: None,
        }
    }

    /// One more fault.
    pub fn add(&mut self, window: FaultWindow) {
        self.windows.push(window);
    }

    /// Applies the faults of the sensed value at stamp `t_s`, in the order of the events.
    pub fn disturb(&mut self, t_s: f64, value: &mut [f64; N]) {
        let stream = &mut self.stream;
        for w in self.windows.iter().filter(|w| w.holds(t_s)) {
            let has = value.iter_mut().enumerate().filter(|(i, _)| w.is_on(*i));
            let has = has.map(|(_, x)| x);
            match w.fault {
                Fault::Bias(bias) => has.for_each(|x| *x += bias),
                Fault::Drift(rate) => has.for_each(|x| *x += rate * (t_s - w.from_s)),
                Fault::Scale(factor) => has.for_each(|x| *x *= factor),
                Fault::Noise(sd) => has.for_each(|x| *x += sd * stream.normal()),
                Fault::Spikes(height) => spike(stream, height, has),
                Fault::Quantised(step) => has.for_each(|x| *x = libm::round(*x / step) * step),
                Fault::DeadBand(band) => has.for_each(|x| *x -= x.clamp(-band, band)),
                _ => {}
            }
        }
    }

    /// Misreads a value at stamp `t_s` as the receiver does: wrong units, signs and axes, in the order of the events.
    fn misread(&self, t_s: f64, mut value: [f64; N]) -> [f64; N] {
        for w in self.windows.iter().filter(|w| w.holds(t_s)) {
            let factor = match w.fault {
                Fault::WrongUnit(unit) => unit.factor(),
                Fault::WrongSign => -1.0,
                Fault::AxesSwapped([i, j]) if i.max(j) < N => {
                    value.swap(i, j);
                    continue;
                }
                _ => continue,
            };
            let has = value.iter_mut().enumerate().filter(|(i, _)| w.is_on(*i));
            has.for_each(|(_, x)| *x *= factor);
        }
        value
    }

    /// The value handed over at stamp `t_s`: nothing when off or lost, the last good value when stuck.
    pub fn hand_over(&mut self, t_s: f64, value: [f64; N]) -> Option<[f64; N]> {
        let mut output = self.misread(t_s, value);
        let mut lost = false;
        for w in self.windows.iter().filter(|w| w.holds(t_s)) {
            match (w.fault, self.last) {
                (Fault::Off, _) => lost = true,
                (Fault::Dropouts(share), _) => lost |= self.stream.uniform() < share,
                // a sensor stuck from its first sample on stays at that one
                (Fault::Stuck, Some(last)) => {
                    let both = output.iter_mut().zip(last).enumerate();
                    let has = both.filter(|(i, _)| w.is_on(*i));
                    has.for_each(|(_, (x, last))| *x = last);
                }
                (Fault::Hysteresis(play), Some(last)) => {
                    let both = output.iter_mut().zip(last).enumerate();
                    let has = both.filter(|(i, _)| w.is_on(*i));
                    has.for_each(|(_, (x, last))| *x = last.clamp(*x - play, *x + play));
                }
                _ => {}
            }
        }
        self.last = Some(output);
        (!lost).then_some(output)
    }
}

/// Adds the height to all of these components, each with its own sign, with [`SPIKE_PROBABILITY`].
fn spike<'a>(stream: &mut Stream, height: f64, value: impl Iterator<Item = &'a mut f64>) {
    if stream.uniform() < SPIKE_PROBABILITY {
        for x in value {
            *x += if stream.uniform() < 0.5 {
                height
            } else {
                -height
            };
        }
    }
}

impl FaultWindow {
    fn holds(&self, t_s: f64) -> bool {
        self.from_s <= t_s && t_s < self.to_s
    }

    fn is_on(&self, axis: usize) -> bool {
        self.axis.is_none_or(|has| has == axis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(list: &[Fault]) -> Faults<1> {
        let mut faults = Faults::new(1, "test");
        for fault in list {
            faults.add(FaultWindow {
                from_s: 2.0,
                to_s: 4.0,
                fault: *fault,
                axis: None,
            });
        }
        faults
    }

    fn at(faults: &mut Faults<1>, t_s: f64, value: f64) -> Option<f64> {
        let mut x = [value];
        faults.disturb(t_s, &mut x);
        faults.hand_over(t_s, x).map(|[y]| y)
    }

    #[test]
    fn off_gives_nothing_inside_its_window_only() {
        let mut f = faults(&[Fault::Off]);
        let seen = [1.99, 2.0, 3.99, 4.0].map(|t| at(&mut f, t, 7.0));
        assert_eq!(seen, [Some(7.0), None, None, Some(7.0)]);
    }

    #[test]
    fn stuck_repeats_the_last_value_before_it() {
        let mut f = faults(&[Fault::Stuck]);
        let seen = [1.9, 2.0, 3.0, 4.0].map(|t| at(&mut f, t, t));
        assert_eq!(seen, [Some(1.9), Some(1.9), Some(1.9), Some(4.0)]);
        let mut from_the_start = faults(&[Fault::Stuck]);
        assert_eq!(
            [2.5, 3.0].map(|t| at(&mut from_the_start, t, t)),
            [Some(2.5), Some(2.5)]
        );
    }

    #[test]
    fn drift_grows_from_its_beginning_and_scale_multiplies() {
        let mut f = faults(&[Fault::Drift(0.5)]);
        assert_eq!(
            [1.0, 2.0, 3.0, 5.0].map(|t| at(&mut f, t, 1.0)),
            [Some(1.0), Some(1.0), Some(1.5), Some(1.0)]
        );
        let mut f = faults(&[Fault::Scale(1.5)]);
        assert_eq!(
            [1.0, 3.0].map(|t| at(&mut f, t, -2.0)),
            [Some(-2.0), Some(-3.0)]
        );
    }

    #[test]
    fn a_wrong_unit_or_sign_multiplies_inside_its_window_only() {
        for (fault, factor) in [
            (Fault::WrongUnit(WrongUnit::KmPerH), 3.6),
            (Fault::WrongUnit(WrongUnit::G), 0.101_971_621_297_792_82),
            (Fault::WrongUnit(WrongUnit::Degrees), 57.295_779_513_082_32),
            (Fault::WrongSign, -1.0),
        ] {
            let mut f = faults(&[fault]);
            assert_eq!(at(&mut f, 1.99, 2.0), Some(2.0));
            let inside = at(&mut f, 2.0, 2.0).unwrap();
            assert!((inside / (2.0 * factor) - 1.0).abs() < 1e-14, "{fault:?}");
            assert_eq!(at(&mut f, 4.0, 2.0), Some(2.0));
        }
    }

    #[test]
    fn swapped_axes_change_places_and_the_third_stays() {
        let mut f: Faults<3> = Faults::new(1, "axes");
        f.add(FaultWindow {
            from_s: 2.0,
            to_s: 4.0,
            fault: Fault::AxesSwapped([0, 2]),
            axis: None,
        });
        assert_eq!(f.hand_over(1.0, [1.0, 2.0, 3.0]), Some([1.0, 2.0, 3.0]));
        assert_eq!(f.hand_over(3.0, [1.0, 2.0, 3.0]), Some([3.0, 2.0, 1.0]));
        assert_eq!(f.hand_over(4.0, [1.0, 2.0, 3.0]), Some([1.0, 2.0, 3.0]));
    }

    #[test]
    fn spikes_are_rare_of_their_size_and_of_both_signs() {
        let mut f: Faults<1> = Faults::new(1, "spikes");
        f.add(FaultWindow {
            from_s: 0.0,
            to_s: f64::INFINITY,
            fault: Fault::Spikes(3.0),
            axis: None,
        });
        let n = 50_000;
        let (mut up, mut down) = (0.0, 0.0);
        for k in 0..n {
            match at(&mut f, f64::from(k), 1.0) {
                Some(4.0) => up += 1.0,
                Some(-2.0) => down += 1.0,
                other => assert_eq!(other, Some(1.0)),
            }
        }
        let each = SPIKE_PROBABILITY / 2.0 * f64::from(n);
        for count in [up, down] {
            assert!(
                f64::abs(count - each) < 5.0 * each.sqrt(),
                "{count} not {each}"
            );
        }
    }

    const N: u32 = 40_000;

    #[test]
    fn noise_has_no_mean_and_the_standard_deviation_asked_for() {
        let mut f = from_the_start(Fault::Noise(0.3), None);
        let (mut sum, mut squares) = (0.0, 0.0);
        for k in 0..N {
            let mut x = [5.0; 3];
            f.disturb(f64::from(k), &mut x);
            sum += x[1] - 5.0;
            squares += (x[1] - 5.0).powi(2);
        }
        let n = f64::from(N);
        assert!((sum / n).abs() < 5.0 * 0.3 / n.sqrt());
        let variance = squares / n / 0.09;
        assert!(
            (variance - 1.0).abs() < 5.0 * (2.0 / n).sqrt(),
            "{variance}"
        );
    }

    #[test]
    fn a_bias_adds_and_steps_round_to_the_nearest_inside_the_window_only() {
        let seen = |fault| [1.9, 2.0, 4.0].map(|t| at(&mut faults(&[fault]), t, 1.3));
        assert_eq!(seen(Fault::Bias(0.5)), [Some(1.3), Some(1.8), Some(1.3)]);
        assert_eq!(
            seen(Fault::Quantised(0.25)),
            [Some(1.3), Some(1.25), Some(1.3)]
        );
    }

    /// Values within the band are lost, and others are that much nearer to zero. With play, a value moves only where
    /// the true one has left the play to one side.
    #[test]
    fn a_dead_band_and_play_lose_what_is_small() {
        let seen = |fault, values: &[f64]| {
            let mut f = from_the_start(fault, None);
            let one = |(k, x): (usize, &f64)| {
                let mut value = [*x; 3];
                f.disturb(k as f64, &mut value);
                f.hand_over(k as f64, value).unwrap()[1]
            };
            values.iter().enumerate().map(one).collect::<Vec<f64>>()
        };
        let dead = seen(Fault::DeadBand(1.5), &[1.0, -1.5, 2.0, -4.0]);
        assert_eq!(dead, [0.0, 0.0, 0.5, -2.5]);
        let play = seen(Fault::Hysteresis(1.0), &[5.0, 5.5, 7.0, 6.5, 5.0, 3.0]);
        assert_eq!(play, [5.0, 5.0, 6.0, 6.0, 6.0, 4.0]);
    }

    #[test]
    fn dropouts_lose_the_share_asked_for_and_change_no_value() {
        let mut f = from_the_start(Fault::Dropouts(0.3), None);
        let kept = (0..N).filter_map(|k| {
            let value = [f64::from(k), 1.0, -1.0];
            let seen = f.hand_over(f64::from(k), value);
            assert!(seen.is_none_or(|seen| seen == value));
            seen
        });
        let (n, kept) = (f64::from(N), kept.count() as f64);
        assert!((kept / n - 0.7).abs() < 5.0 * f64::sqrt(0.21 / n), "{kept}");
        for (share, rest) in [(0.0, 100), (1.0, 0)] {
            let mut f = from_the_start(Fault::Dropouts(share), None);
            let kept = (0..100).filter(|k| f.hand_over(f64::from(*k), [0.0; 3]).is_some());
            assert_eq!(kept.count(), rest);
        }
    }

    /// A fault of an axis changes that one, and leaves the others as they were to the last bit.
    #[test]
    fn a_fault_of_an_axis_leaves_the_others_alone() {
        for fault in [
            Fault::Stuck,
            Fault::Bias(0.1),
            Fault::Drift(0.1),
            Fault::Scale(1.1),
            Fault::Noise(0.1),
            Fault::Spikes(0.1),
            Fault::Quantised(0.1),
            Fault::DeadBand(0.1),
            Fault::Hysteresis(0.1),
            Fault::WrongSign,
        ] {
            for axis in 0..3 {
                let mut f = from_the_start(fault, Some(axis));
                let mut changed = false;
                for k in 1..500 {
                    let (t_s, value) =
                        (f64::from(k), [0.37, -1.13, 9.81].map(|x| x + f64::from(k)));
                    let mut seen = value;
                    f.disturb(t_s, &mut seen);
                    let seen = f.hand_over(t_s, seen).unwrap();
                    for i in (0..3).filter(|i| *i != axis) {
                        assert_eq!(seen[i].to_bits(), value[i].to_bits(), "{fault:?}");
                    }
                    changed |= seen[axis] != value[axis];
                }
                assert!(changed, "{fault:?}");
            }
        }
    }

    fn from_the_start(fault: Fault, axis: Option<usize>) -> Faults<3> {
        let mut faults = Faults::new(1, "test");
        faults.add(FaultWindow {
            from_s: 0.0,
            to_s: f64::INFINITY,
            fault,
            axis,
        });
        faults
    }
}

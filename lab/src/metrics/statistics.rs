//! Means, extremes and shares, taken sample by sample: their memory does not grow with the samples. Of nothing they
//! are not a number.

/// A number computed from samples that come one after the other, in the order of time.
pub(crate) trait Accumulator<T> {
    /// Adds a sample.
    fn add(&mut self, x: &T);
    /// Adds samples that follow each other.
    fn add_all(&mut self, xs: &[T]) {
        xs.iter().for_each(|x| self.add(x));
    }
    /// The number for the samples so far.
    fn value(&self) -> f64;
}

/// Any accumulator over samples `T`.
pub(crate) type Running<T> = Box<dyn Accumulator<T>>;

/// Mean of numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mean {
    sum: f64,
    n: f64,
}

impl Mean {
    /// Adds a number.
    pub(crate) fn add(&mut self, x: f64) {
        self.sum += x;
        self.n += 1.0;
    }

    /// Adds a yes or no: the mean is the share of yes.
    pub(crate) fn add_bool(&mut self, yes: bool) {
        self.add(if yes { 1.0 } else { 0.0 });
    }

    /// The mean; NaN without a number.
    pub(crate) fn value(&self) -> f64 {
        match self.n > 0.0 {
            true => self.sum / self.n,
            false => f64::NAN,
        }
    }
}

/// Makes an accumulator of one value of each sample.
struct Folded<A, F, G, H> {
    of: F,
    add: G,
    value: H,
    so_far: A,
}

impl<T, A, F, G, H> Accumulator<T> for Folded<A, F, G, H>
where
    F: Fn(&T) -> f64,
    G: Fn(&mut A, f64),
    H: Fn(&A) -> f64,
{
    fn add(&mut self, x: &T) {
        (self.add)(&mut self.so_far, (self.of)(x));
    }

    fn value(&self) -> f64 {
        (self.value)(&self.so_far)
    }
}

pub(crate) fn mean<T: 'static>(of: impl Fn(&T) -> f64 + 'static) -> Running<T> {
    Box::new(Folded {
        of,
        add: Mean::add,
        value: Mean::value,
        so_far: Mean::default(),
    })
}

/// Root of the mean square.
pub(crate) fn rms<T: 'static>(of: impl Fn(&T) -> f64 + 'static) -> Running<T> {
    Box::new(Folded {
        of,
        add: |mean: &mut Mean, x: f64| mean.add(x * x),
        value: |mean: &Mean| mean.value().sqrt(),
        so_far: Mean::default(),
    })
}

/// Root of the mean square about the mean: what is left when a constant part is taken away.
pub(crate) fn scatter<T: 'static>(of: impl Fn(&T) -> f64 + 'static) -> Running<T> {
    Box::new(Folded {
        of,
        add: |[x, squares]: &mut [Mean; 2], value: f64| {
            x.add(value);
            squares.add(value * value);
        },
        value: |[x, squares]: &[Mean; 2]| {
            let variance = squares.value() - x.value() * x.value();
            match variance.is_nan() {
                true => f64::NAN,
                false => variance.max(0.0).sqrt(),
            }
        },
        so_far: [Mean::default(); 2],
    })
}

/// Root mean square of an error over the root mean square of its bound, of samples with a bound, from the first valid
/// sample on.
pub(crate) fn rms_over<T: 'static>(
    pair: impl Fn(&T) -> [f64; 2] + 'static,
    valid: impl Fn(&T) -> bool + 'static,
) -> Running<T> {
    Box::new(Ratio {
        pair,
        valid,
        begun: false,
        squares: [Mean::default(); 2],
    })
}

/// An accumulator of an error and its bound.
struct Ratio<F, G> {
    pair: F,
    valid: G,
    begun: bool,
    /// Mean squares of the error and of its bound.
    squares: [Mean; 2],
}

impl<T, F: Fn(&T) -> [f64; 2], G: Fn(&T) -> bool> Accumulator<T> for Ratio<F, G> {
    fn add(&mut self, x: &T) {
        self.begun |= (self.valid)(x);
        let pair = (self.pair)(x);
        if self.begun && pair[1].is_finite() {
            let all = self.squares.iter_mut().zip(pair);
            all.for_each(|(mean, x)| mean.add(x * x));
        }
    }

    fn value(&self) -> f64 {
        let [errors, bounds] = self.squares.map(|mean| mean.value());
        (errors / bounds).sqrt()
    }
}

/// Largest magnitude.
pub(crate) fn max<T: 'static>(of: impl Fn(&T) -> f64 + 'static) -> Running<T> {
    Box::new(Folded {
        of,
        add: |most: &mut f64, x: f64| *most = most.max(x.abs()),
        value: |most: &f64| *most,
        so_far: f64::NAN,
    })
}

/// The 95 % point of χ² with one degree of freedom.
const CHI2_95: f64 = 3.841_458_820_694_124;

/// Share of normalised squares within the 95 % bound of χ² with one degree of freedom; NaN if a square is NaN.
pub(crate) fn share_in_band<T: 'static>(of: impl Fn(&T) -> f64 + 'static) -> Running<T> {
    Box::new(Folded {
        of,
        add: |mean: &mut Mean, x: f64| {
            mean.add(match x {
                x if x.is_nan() => x,
                x if x <= CHI2_95 => 1.0,
                _ => 0.0,
            });
        },
        value: Mean::value,
        so_far: Mean::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn over(mut statistic: Running<f64>, x: &[f64]) -> f64 {
        x.iter().for_each(|x| statistic.add(x));
        statistic.value()
    }

    #[test]
    fn of_nothing_no_number() {
        let x = |x: &f64| *x;
        for of_nothing in [mean(x), rms(x), max(x), share_in_band(x)] {
            assert!(over(of_nothing, &[]).is_nan());
        }
    }

    /// Of 3, −4, 0, 5.
    #[test]
    fn they_are_what_their_names_say() {
        let x = [3.0, -4.0, 0.0, 5.0];
        assert_eq!(over(mean(|x| *x), &x), 1.0);
        assert_eq!(over(rms(|x| *x), &x), 12.5f64.sqrt());
        assert_eq!(over(max(|x| *x), &x[..3]), 4.0);
        let mut share = Mean::default();
        x.iter().for_each(|x| share.add_bool(*x > 0.0));
        assert_eq!(share.value(), 0.5);
    }

    /// √((3² + 4²)/(1² + 2²)), whatever the sample without a bound is; of nothing bounded, nothing.
    #[test]
    fn a_ratio_counts_what_is_bounded() {
        let ratio = |x: &[[f64; 2]]| {
            let mut ratio = rms_over(|x: &[f64; 2]| *x, |_| true);
            x.iter().for_each(|x| ratio.add(x));
            ratio.value()
        };
        assert_eq!(
            ratio(&[[3.0, 1.0], [9.0, f64::NAN], [-4.0, 2.0]]),
            5f64.sqrt()
        );
        assert!(ratio(&[[3.0, f64::NAN]]).is_nan());
    }

    /// χ²₁ is the square of a standard normal: 1.96² bounds 95 % of it.
    #[test]
    fn the_band_is_that_of_chi_square() {
        assert!((CHI2_95.sqrt() - 1.959_963_984_540_054).abs() < 1e-14);
        assert_eq!(over(share_in_band(|x| *x), &[0.1, 3.8, 3.9, 50.0]), 0.5);
        assert!(over(share_in_band(|x| *x), &[0.1, f64::NAN]).is_nan());
    }
}

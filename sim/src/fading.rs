//! Small remainders of values that decay exponentially.

/// Size below which a remainder has no effect.
const NOTHING: f64 = 1e-150;

/// Replaces a remainder below 1e-150 by 0. It would go on to fade into subnormal numbers, where each operation costs a
/// processor some hundred cycles, and rounding would keep it there for ever.
pub(crate) fn faded(rest: f64) -> f64 {
    if rest.abs() < NOTHING { 0.0 } else { rest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rest_fades_to_zero_and_anything_else_stays() {
        let mut rest = -1.0;
        for _ in 0..10_000 {
            rest = faded(0.9 * rest);
            assert!(!rest.is_subnormal());
        }
        assert_eq!(rest, 0.0);
        for x in [1e-149, -1e-30, 1.0, f64::INFINITY] {
            assert_eq!(faded(x), x);
        }
        assert!(faded(f64::NAN).is_nan());
    }
}

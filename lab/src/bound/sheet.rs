//! Noise of the instruments from a sensor sheet, as the bound needs it.

use monorig_sim::config::checked::Positive;
use monorig_sim::sensors::instruments::{accelerometer, gyro, motor_torque, wheel_speed};
use monorig_sim::sensors::spec::{InstrumentSpec, InstrumentSpecs};

/// Noise of one instrument.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct InstrumentNoise {
    /// Samples per second, Hz.
    pub(crate) rate_hz: f64,
    /// White noise of a sample, unit of the instrument.
    pub(crate) white_sd: f64,
    /// White noise of a sample as a share of the reading.
    pub(crate) white_rel: f64,
    /// Bias at the start, unit of the instrument.
    pub(crate) bias_sd: f64,
    /// Growth of the bias, unit/√s.
    pub(crate) bias_walk: f64,
    /// Error of scale.
    pub(crate) scale_sd: f64,
}

/// Noise of the instruments for mass and slope; `None` for an instrument that the sheet does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SheetNoise {
    /// m/s².
    pub accelerometer: Option<InstrumentNoise>,
    /// rad/s.
    pub(crate) gyro: Option<InstrumentNoise>,
    /// m/s.
    pub wheel_speed: Option<InstrumentNoise>,
    /// N·m.
    pub(crate) motor_torque: Option<InstrumentNoise>,
}

impl SheetNoise {
    /// Reads the noise of these instruments.
    pub(crate) fn of(specs: &InstrumentSpecs) -> Self {
        let of = |name: &str| specs.get(name).map(noise);
        Self {
            accelerometer: of(accelerometer::KIND.name),
            gyro: of(gyro::KIND.name),
            wheel_speed: of(wheel_speed::KIND.name),
            motor_torque: of(motor_torque::KIND.name),
        }
    }
}

fn noise(spec: &InstrumentSpec) -> InstrumentNoise {
    let (errors, rate_hz) = (&spec.errors, spec.sampling.rate_hz.get());
    let (density, walk) = (
        errors.noise_density.get(),
        errors.random_walk_of_integral.get(),
    );
    // of a sample: σ² = noise_sd² + density²·rate/2 + walk²·rate + quantisation²/12
    let by_rate = density * density / 2.0 + walk * walk;
    let step = errors.quantisation.map_or(0.0, Positive::get);
    let noise_sd = errors.noise_sd.get();
    let variance = noise_sd * noise_sd + by_rate * rate_hz + step * step / 12.0;
    InstrumentNoise {
        rate_hz,
        white_sd: variance.sqrt(),
        white_rel: errors.noise_sd_rel.get(),
        bias_sd: errors.drawn_bias_sd(),
        bias_walk: errors.bias_random_walk.get(),
        scale_sd: errors.scale_error_sd.get(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_sim::config::checked::NonNegative;
    use monorig_sim::sensors::spec::{Errors, Sampling};

    /// A one-sided density N over the band up to half the rate, and a walk of the integral of N/√2, are the same noise.
    #[test]
    fn a_density_and_a_walk_of_the_integral_are_one_noise() {
        let spec = |errors| InstrumentSpec {
            sampling: Sampling::at(200.0),
            errors,
            ..InstrumentSpec::default()
        };
        let density = noise(&spec(Errors {
            noise_density: NonNegative::new(9.81e-4),
            ..Errors::default()
        }));
        let walk = noise(&spec(Errors {
            random_walk_of_integral: NonNegative::new(9.81e-4 / 2f64.sqrt()),
            ..Errors::default()
        }));
        assert!((density.white_sd - 9.81e-4 * 10.0).abs() < 1e-12);
        assert!((density.white_sd - walk.white_sd).abs() < 1e-12);
    }
}

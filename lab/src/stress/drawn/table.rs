//! Ranges from which faults are drawn: one place for all. A size goes from one that no estimator minds to one that no
//! instrument in working order shows, and is even in its logarithm.

use crate::draw::four_digits;
use monorig_sim::config::scenario::FaultKind;

/// A sensor for which faults are drawn.
pub(super) struct Sensor {
    /// Name in an event.
    pub(super) name: &'static str,
    /// Its instruments in a sensor sheet.
    pub(super) instruments: &'static [&'static str],
    /// Weight with which the sensor is drawn.
    pub(super) weight: f64,
    /// Unit of its values.
    pub(super) unit: &'static str,
    /// True for a sensor with three axes; other sensors have a reading on every drive unit.
    pub(super) has_axes: bool,
    /// Faults of this sensor in addition to the faults of all sensors.
    own: &'static [FaultRange],
}

/// A kind of fault, and the sizes that are drawn.
#[derive(Clone, Copy)]
pub(super) struct FaultRange {
    /// Name of the kind in a summary.
    pub(super) kind: &'static str,
    /// The fault.
    pub(super) fault: Drawn,
    /// Least and largest size; `None` for a fault without a size.
    pub(super) size: Option<[f64; 2]>,
}

/// Form of a fault in a condition.
#[derive(Clone, Copy)]
pub(super) enum Drawn {
    /// An event: one of these kinds, and the size made of the drawn one and a sign.
    Event(&'static [FaultKind], fn(f64, bool) -> f64),
    /// Samples late in the whole run, by ms.
    Late {
        /// True if the samples are stamped on arrival.
        wrong_stamps: bool,
    },
}

fn plain(size: f64, _: bool) -> f64 {
    size
}

fn signed(size: f64, plus: bool) -> f64 {
    if plus { size } else { -size }
}

fn factor(size: f64, plus: bool) -> f64 {
    four_digits(libm::exp(signed(size, plus)))
}

const fn of(kind: &'static str, fault: Drawn, low: f64, high: f64) -> FaultRange {
    FaultRange {
        kind,
        fault,
        size: Some([low, high]),
    }
}

const fn without_size(kind: &'static str, kinds: &'static [FaultKind]) -> FaultRange {
    FaultRange {
        kind,
        fault: Drawn::Event(kinds, plain),
        size: None,
    }
}

const BIAS: Drawn = Drawn::Event(&[FaultKind::Bias], signed);
const DRIFT: Drawn = Drawn::Event(&[FaultKind::Drift], signed);
const SCALE: Drawn = Drawn::Event(&[FaultKind::Scale], factor);
const NOISE: Drawn = Drawn::Event(&[FaultKind::Noise], plain);
const SPIKES: Drawn = Drawn::Event(&[FaultKind::Spikes], plain);
const QUANTISED: Drawn = Drawn::Event(&[FaultKind::Quantised], plain);
const DROPOUTS: Drawn = Drawn::Event(&[FaultKind::Dropouts], plain);
const LATE: Drawn = Drawn::Late {
    wrong_stamps: false,
};
const STAMPED_LATE: Drawn = Drawn::Late { wrong_stamps: true };
const SWAPPED: FaultRange = without_size(
    "axes_swapped",
    &[
        FaultKind::AxesXySwapped,
        FaultKind::AxesXzSwapped,
        FaultKind::AxesYzSwapped,
    ],
);

/// Faults of every sensor.
const OF_ALL: [FaultRange; 7] = [
    without_size("off", &[FaultKind::Off]),
    without_size("stuck", &[FaultKind::Stuck]),
    without_size("wrong_sign", &[FaultKind::WrongSign]),
    of("scale", SCALE, 0.003, 0.7), // the size is the logarithm of the factor
    of("dropouts", DROPOUTS, 0.02, 0.9),
    of("late", LATE, 5.0, 2000.0), // ms
    of("stamped_late", STAMPED_LATE, 5.0, 2000.0),
];

/// The sensors, and the sizes of their own faults in their units; sizes of drifts are per second.
pub(super) const SENSORS: [Sensor; 6] = [
    Sensor {
        name: "accelerometer",
        instruments: &["accelerometer"],
        weight: 1.0,
        unit: "m/s²",
        has_axes: true,
        own: &[
            of("bias", BIAS, 0.005, 5.0),
            of("drift", DRIFT, 1e-4, 0.1),
            of("noise", NOISE, 0.02, 10.0),
            of("spikes", SPIKES, 0.1, 50.0),
            of("quantised", QUANTISED, 0.005, 5.0),
            SWAPPED,
            without_size("wrong_unit", &[FaultKind::InG]),
        ],
    },
    Sensor {
        name: "gyro",
        instruments: &["gyro"],
        weight: 1.0,
        unit: "rad/s",
        has_axes: true,
        own: &[
            of("bias", BIAS, 1e-5, 0.3),
            of("drift", DRIFT, 1e-7, 0.01),
            of("noise", NOISE, 1e-3, 1.0),
            of("spikes", SPIKES, 0.01, 5.0),
            of("quantised", QUANTISED, 1e-4, 0.3),
            SWAPPED,
            without_size("wrong_unit", &[FaultKind::InDegrees]),
        ],
    },
    Sensor {
        name: "imu",
        instruments: &["accelerometer", "gyro"],
        weight: 0.5,
        unit: "",
        has_axes: true,
        own: &[SWAPPED],
    },
    Sensor {
        name: "wheel_speed",
        instruments: &["wheel_speed"],
        weight: 1.0,
        unit: "m/s",
        has_axes: false,
        own: &[
            of("bias", BIAS, 0.002, 1.0),
            of("drift", DRIFT, 1e-4, 0.1),
            of("noise", NOISE, 0.005, 2.0),
            of("spikes", SPIKES, 0.05, 10.0),
            of("quantised", QUANTISED, 0.002, 1.0),
            without_size("wrong_unit", &[FaultKind::KmPerH]),
        ],
    },
    Sensor {
        name: "motor_torque",
        instruments: &["motor_torque"],
        weight: 1.0,
        unit: "N·m",
        has_axes: false,
        own: &[
            of("bias", BIAS, 0.2, 50.0),
            of("drift", DRIFT, 0.005, 5.0),
            of("noise", NOISE, 0.5, 100.0),
            of("spikes", SPIKES, 2.0, 500.0),
            of("quantised", QUANTISED, 0.2, 50.0),
        ],
    },
    Sensor {
        name: "clamp_pressure",
        instruments: &["clamp_pressure"],
        weight: 0.25,
        unit: "MPa",
        has_axes: false,
        own: &[
            of("bias", BIAS, 0.02, 5.0),
            of("drift", DRIFT, 5e-4, 0.2),
            of("noise", NOISE, 0.02, 5.0),
            of("spikes", SPIKES, 0.1, 16.0),
            of("quantised", QUANTISED, 0.01, 5.0),
        ],
    },
];

impl Sensor {
    /// Every fault that the sensor can have.
    pub(super) fn faults(&self) -> Vec<FaultRange> {
        OF_ALL.iter().chain(self.own).copied().collect()
    }
}

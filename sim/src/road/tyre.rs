//! Brush tyre with combined slip: what the road does to a wheel.
//!
//! ```text
//! ℓ σ̇ + V σ = slip speed                     ℓ relaxation length, V = max(|ωR|, |v|); (σx, σy) long. and lateral slip
//! γx = Cx σx / (3 µx N)    γy = Cy σy / (3 µy N)    γ = √(γx² + γy²)
//! Fx = µx N h γx/γ         Fy = µy N h γy/γ         h = 3γ − 3γ² + γ³ below γ = 1, else 1
//! ```
//!
//! So (Fx/µx N)² + (Fy/µy N)² = h² ≤ 1: the friction ellipse is kept by construction. For small slip Fx = Cx σx, Fy =
//! Cy σy.
//!
//! Sources: Pacejka 2012, "Tire and Vehicle Dynamics", section 3.2 (brush model, combined slip; here with different
//! stiffness and adhesion along and across) and section 8.6 (relaxation length; damping that fades in towards
//! standstill).

use crate::fading::faded;

/// Speed below which the tyre has additional damping, so that a stopping car does not keep rocking, m/s.
const DAMPED_BELOW_MPS: f64 = 2.5;
/// Damping over stiffness at standstill, s.
const DAMPING_S: f64 = 0.06;

/// A tyre, with its stiffnesses at the load of their measurement.
#[derive(Clone, Copy, Debug)]
pub struct Tyre {
    /// Longitudinal force per unit of slip, over the load.
    pub slip_stiffness: f64,
    /// Lateral force per radian of slip angle, over the load.
    pub cornering_stiffness: f64,
    /// Share of the stiffness that is lost when the load doubles.
    pub load_loss: f64,
    /// Load at which the stiffnesses hold, N.
    pub nominal_load_n: f64,
    /// Adhesion coefficient along the wheel on a clean dry road.
    pub adhesion_along: f64,
    /// The same across.
    pub adhesion_across: f64,
    /// Relaxation length, m.
    pub relaxation_m: f64,
}

/// Sliding velocity of the contact, in the wheel's own directions, m/s.
#[derive(Clone, Copy, Debug)]
pub struct Slide {
    /// Circumferential speed ωR.
    pub rim: f64,
    /// Speed of the wheel's centre along the wheel.
    pub along: f64,
    /// Speed of the wheel's centre to its left.
    pub across: f64,
}

impl Tyre {
    /// Stiffness (along, across) at a load, N per unit of slip and N/rad.
    pub fn stiffness(&self, load_n: f64) -> [f64; 2] {
        let lost = self.load_loss * (load_n / self.nominal_load_n - 1.0);
        let share = (1.0 - lost).clamp(0.2, 2.0) * load_n;
        [
            self.slip_stiffness * share,
            self.cornering_stiffness * share,
        ]
    }

    /// Slip after a step of `dt` (s), limited to the force that the contact can carry at `load_n` (N) and `grip`
    /// (adhesion relative to the dry adhesion).
    pub fn relax(&self, slip: [f64; 2], s: &Slide, load_n: f64, grip: f64, dt: f64) -> [f64; 2] {
        let speed = s
            .rim
            .abs()
            .max(libm::sqrt(s.along * s.along + s.across * s.across));
        let keep = 1.0 / (1.0 + dt * speed / self.relaxation_m);
        let gain = dt / self.relaxation_m;
        let slip = [
            (slip[0] + gain * (s.rim - s.along)) * keep,
            (slip[1] - gain * s.across) * keep,
        ]
        .map(faded);
        let gamma = self.gamma(slip, load_n, grip);
        let size = libm::sqrt(gamma[0] * gamma[0] + gamma[1] * gamma[1]);
        if size > 1.0 {
            slip.map(|x| x / size)
        } else {
            slip
        }
    }

    /// Force of the road on the wheel (along, to the left), N.
    pub fn force(&self, slip: [f64; 2], s: &Slide, load_n: f64, grip: f64) -> [f64; 2] {
        if load_n <= 0.0 || grip <= 0.0 {
            return [0.0; 2];
        }
        let speed = libm::sqrt(s.along * s.along + s.across * s.across);
        let fade = (1.0 - speed / DAMPED_BELOW_MPS).max(0.0);
        let damping = DAMPING_S * fade * fade;
        let slip = [
            slip[0] + damping * (s.rim - s.along),
            slip[1] - damping * s.across,
        ];
        let gamma = self.gamma(slip, load_n, grip);
        let size = libm::sqrt(gamma[0] * gamma[0] + gamma[1] * gamma[1]);
        let share = if size < 1.0 {
            3.0 - 3.0 * size + size * size // h/γ, which does not divide by zero
        } else {
            1.0 / size
        };
        let [along, across] = self.limits(load_n, grip);
        [along * share * gamma[0], across * share * gamma[1]]
    }

    /// Largest force along and across, N.
    pub fn limits(&self, load_n: f64, grip: f64) -> [f64; 2] {
        [self.adhesion_along, self.adhesion_across].map(|mu| mu * grip * load_n)
    }

    fn gamma(&self, slip: [f64; 2], load_n: f64, grip: f64) -> [f64; 2] {
        let (stiffness, limits) = (self.stiffness(load_n), self.limits(load_n, grip));
        [0, 1].map(|i| stiffness[i] * slip[i] / (3.0 * limits[i]).max(1e-9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tyre() -> Tyre {
        Tyre {
            slip_stiffness: 18.0,
            cornering_stiffness: 12.0,
            load_loss: 0.1,
            nominal_load_n: 5300.0,
            adhesion_along: 0.95,
            adhesion_across: 0.9,
            relaxation_m: 0.3,
        }
    }

    const ROLLING: Slide = Slide {
        rim: 20.0,
        along: 20.0,
        across: 0.0,
    };

    #[test]
    fn small_slip_gives_the_linear_tyre() {
        let (t, load) = (tyre(), 5300.0);
        let [fx, fy] = t.force([1e-6, -2e-6], &ROLLING, load, 1.0);
        assert!((fx / (18.0 * load * 1e-6) - 1.0).abs() < 1e-4, "{fx}");
        assert!((fy / (-12.0 * load * 2e-6) - 1.0).abs() < 1e-4, "{fy}");
    }

    #[test]
    fn no_slip_leaves_the_friction_ellipse() {
        let t = tyre();
        for k in 0..4000 {
            let (a, size) = (f64::from(k) * 0.1, 1e-4 * 1.004f64.powi(k));
            let slip = [size * a.cos(), size * a.sin()];
            for (load, grip) in [(10.0, 1.0), (5300.0, 1.0), (12_000.0, 0.2)] {
                let [fx, fy] = t.force(slip, &ROLLING, load, grip);
                let [mx, my] = t.limits(load, grip);
                assert!((fx / mx).powi(2) + (fy / my).powi(2) <= 1.0 + 1e-12);
            }
        }
        let [fx, _] = t.force([1.0, 0.0], &ROLLING, 5300.0, 1.0);
        assert!(
            (fx - 0.95 * 5300.0).abs() < 1e-9,
            "a spinning wheel pulls with all there is"
        );
    }

    /// After many relaxation lengths the slip is slip speed over V.
    #[test]
    fn slip_settles_at_the_slip_ratio() {
        let (t, s) = (
            tyre(),
            Slide {
                rim: 20.2,
                along: 20.0,
                across: -0.3,
            },
        );
        let mut slip = [0.0; 2];
        for _ in 0..1000 {
            slip = t.relax(slip, &s, 5300.0, 1.0, 5e-4);
        }
        assert!((slip[0] - 0.2 / 20.2).abs() < 1e-9 && (slip[1] - 0.3 / 20.2).abs() < 1e-9);
    }
}

//! Every number of monorig's own estimator that a user does not set: its unit, and where it comes from.
//!
//! Provenance: *derived* follows from another number or from the hardware, *data sheet* is the sheet of an instrument,
//! *measured* names the note with the measurement, *chosen* was set by hand. Values that a user sets stand with the
//! parameters of each filter. `estimators/tests/estimators/closure.rs` refuses a numeric constant in a file of
//! the rooms of our own estimator.

use crate::Real;

/// Declares groups of numbers: for each a type, whose fields tell unit and provenance, and a constant with the values.
macro_rules! groups {
    ($($(#[$about:meta])* $name:ident: $type:ident { $($(#[$doc:meta])* $field:ident: $number:ty = $value:expr,)* })*) => {
        $(
            $(#[$about])*
            #[derive(Clone, Copy, Debug)]
            pub(crate) struct $type {
                $($(#[$doc])* pub(crate) $field: $number,)*
            }

            $(#[$about])*
            pub(crate) const $name: $type = $type { $($field: $value,)* };
        )*
    };
}

groups! {
    /// Assumptions of the filters about the rail and motion on it.
    RAIL: Rail {
        /// Distance behind the read rail at which η is the difference of the grade, over which the last correction by
        /// the force fades, m. Chosen.
        eta_m: Real = 9.0,
        /// Standard deviation of the grade ahead of the read rail, rad/m. Chosen.
        ahead_rad_per_m: Real = 0.02,
        /// Standard deviation of the grade ahead due to the gradient at the end of the read rail, rad per rad/m.
        /// Chosen.
        ahead_m: Real = 0.7,
        /// Standard deviations of the grade `eta_m` behind the read rail, rad: of a train that is switched on at a
        /// standstill, and of one that came to where it is unseen. Chosen.
        behind_sd_rad: [Real; 2] = [0.02, 0.3],
        /// Correlation distance of η behind the remembered rail, m. Chosen.
        eta_memory_m: Real = 2.0,
        /// Distance of the foremost mass ahead of the read rail up to which a block is used, and down to which a jump
        /// of the force counts as on unread rail; and the largest mean distance of the tare behind the remembered rail
        /// at which a block is used when going back; the standard deviation of the distance to the read rail up to
        /// which the rail is remembered, m. Chosen.
        edge_m: Real = 0.5,
        /// Sharpest vertical curvature, rad/m: a faster turn of a slope over the way is that of an accelerometer, of
        /// wheels or of a load that jump. Half of it is the standard deviation of the change of an unread grade per
        /// distance gone back. Chosen: a radius of 8 m.
        max_turn_radpm: Real = 0.13,
        /// Sharpest curvature of any track or road, 1/m. Chosen: a radius of 2 m.
        max_track_per_m: Real = 0.5,
    }
    /// Times that several tests and means have in common.
    TIMES: Times {
        /// Transient of drive, brake or body that filters let pass, s: low-pass of torques, brake and gains, quiet time
        /// before a standstill or a block counts, time after which a learnt noise counts. Chosen.
        brief_s: Real = 0.3,
        /// Time without a sample after which an instrument is lost, without a new value after which it is stuck, and
        /// for which a test rests or smooths, s. Chosen.
        lost_s: Real = 0.5,
        /// Memory of a mean that decides, s: mean specific force, lead of the wheels, contradiction of a start; also
        /// the largest age of a used sample, and the step back of a clock that was set. Chosen.
        mean_s: Real = 1.0,
        /// Pause after which a filter starts again, and memory of what was before a step or a turn, s. Chosen.
        pause_s: Real = 2.0,
        /// Memory of noise and ages; time after which a gyro counts as missing, s. Chosen.
        memory_s: Real = 5.0,
        /// Time after a start in which a filter must show that it is right; memory of the scales of the wheels, s.
        /// Chosen.
        young_s: Real = 20.0,
    }
    /// Motion of a train.
    MOTION: Motion {
        /// Speed from which a train moves, m/s: a change of its grade is one by way, a bend and a vertical curvature
        /// are read, a block of its force is of use. Chosen.
        moves_mps: Real = 0.06,
    }
    /// Common limits of tests.
    STATISTICS: Statistics {
        /// Number of standard deviations beyond which a difference is more than noise: an innovation is deweighted and
        /// counts linearly (Huber 1964), a gain is wrong. Chosen: 99.7 % of a normal variable is within.
        noise_sd: Real = 3.0,
        /// Number of standard deviations within which two values may be the same. Chosen.
        same_sd: Real = 2.0,
        /// Number of standard deviations, or of usual steps between samples, beyond which a value is a fault. Chosen.
        fault_sd: Real = 6.0,
        /// Limit of the NIS of one innovation: a bump of one or two samples is for the gate, does not end validity and
        /// does not inflate the noise further. Chosen: five standard deviations.
        max_nis: Real = 25.0,
        /// Largest weight of one value in a running mean, as a multiple of the mean. Chosen: joints and bumps are no
        /// noise.
        clip: Real = 4.0,
        /// Number of consecutive events that cannot be chance: rejections of a gate, repetitions of a vector, blocks
        /// after a jump of the force. Chosen.
        in_a_row: u32 = 3,
        /// Number of used blocks, of samples of a regression, or of windows that are alike, after which a mass or a
        /// bias is known. Chosen.
        confirming: u32 = 6,
        /// Number of samples in the usual size of a jump or an innovation. Chosen.
        samples: Real = 64.0,
    }
    /// Windows of the specific force.
    FORCE_WINDOW: ForceWindow {
        /// Length of a window, s. Chosen: five samples at 100 Hz.
        window_s: Real = 0.05,
        /// Velocity random walk that is assumed until the instrument's noise has been learnt, m/s/√s. Chosen: that of a
        /// shaken robot.
        unseen_walk: Real = 0.1,
    }
    /// Bias of the gyro at a standstill.
    STANDSTILL: Standstill {
        /// Noise of the gyro with the vibration of a standing vehicle, rad/√s. Chosen.
        noise: Real = 3e-4,
        /// Share of the standstill speed below which the vehicle stands. Chosen.
        speed_share: Real = 0.4,
        /// Length of a window of the gyro's mean, s. Chosen.
        window_s: Real = 0.25,
        /// Largest difference of two windows, as a share of their difference from the bias. Chosen.
        max_difference: Real = 0.25,
    }
    /// Gate and scales of the wheel speeds.
    WHEELS: Wheels {
        /// Share of the speed by which wheels may differ beyond their noise: creep, scale. Chosen.
        spread: Real = 0.004,
        /// Number of wheels whose agreement excludes equal slip. Chosen.
        min_agreed: usize = 3,
        /// Largest scale error of one wheel against the mean: one that reads 0 must not divide by 0. Chosen.
        max_scale: Real = 0.2,
        /// Unknown change of the acceleration, m/s³. Chosen: the jerk of a start.
        jerk_mps3: Real = 0.5,
    }
    /// Excitation gate of the regressions.
    EXCITATION: Excitation {
        /// Longest period that counts, s. Chosen.
        max_period_s: Real = 60.0,
    }
    /// Gravity check of an accelerometer.
    GRAVITY_CHECK: GravityCheck {
        /// The least and the largest mean specific force over g. Derived: braking at 5 m/s² makes 1.12.
        size: [Real; 2] = [0.8, 1.25],
        /// Least share of g along the vertical axis. Derived: the cosine of the steepest grade, 60°.
        min_upright: Real = 0.5,
    }
    /// Largest rates that a vehicle can have.
    GYRO_RANGE: GyroRange {
        /// Largest bias of an uncalibrated gyro, rad/s. Chosen: 9 °/s.
        max_bias_radps: Real = 0.15,
    }
    /// Kinematic consistency of accelerometer, gyro and wheels.
    CONSISTENCY: Consistency {
        /// Time constant of the high-pass of the band, s. Chosen.
        high_pass_s: Real = 4.0,
        /// Time constant of a second high-pass, which removes the bias of the gyro, s. Chosen.
        leak_s: Real = 16.0,
        /// Rate of the regression, 1/s. Chosen.
        rate_hz: Real = 5.0,
        /// Noise of a sample, m/s²: vibration behind the low-pass, the road under the wheels, a nod of the body by one
        /// degree. Chosen.
        noise_mps2: Real = 0.1,
        /// Share of noise in the regressors: a large start or a slip counts for no more than several small ones.
        /// Chosen.
        relative_noise: Real = 0.3,
        /// Noise of a sample due to slopes without a gyro, m/s² for each m/s of speed. Chosen.
        slope_noise_per_s: Real = 1.0,
        /// Standard deviation of a gain before any sample. Chosen.
        gain_sd: Real = 0.5,
        /// Largest error of a correct gain. Chosen.
        tolerance: Real = 0.4,
        /// Forgetting, per sample, of the gain that the sample informs. Chosen.
        forgetting: Real = 0.97,
        /// Forgetting, per sample, of the gain of the left axis. Chosen.
        cross_forgetting: Real = 0.93,
        /// High-pass of both axes before the regression, s: axes that are exchanged on a grade leave a step on each,
        /// which must have died out soon. Chosen.
        cross_high_pass_s: Real = 1.5,
        /// Share of noise in the regressors in the regression of the gyro: a slip, or a nod, is shorter than a ramp and
        /// must not decide. Chosen.
        turn_noise: Real = 0.6,
        /// Largest pitch rate of any track, rad/s: a gyro that reads more is itself in doubt, and the wheels are not.
        /// Chosen.
        max_pitch_radps: Real = 0.3,
        /// Smallest wrong step of the wheel speed, m/s. Chosen.
        step_mps: Real = 0.4,
        /// Smallest wrong step, as a share of the speed before the step. Chosen.
        step_share: Real = 0.25,
    }
    /// Load-change detector of the regressions.
    LOAD_CHANGE: LoadChange {
        /// Size up to which a residual is ordinary, in standard deviations. Chosen.
        ordinary_sd: Real = 1.5,
    }
    /// Observability of the grade by the force balance.
    OBSERVABILITY: Observability {
        /// Standard deviation below which a grade is known again, rad. Derived: twice that of a steady run.
        found_sd_rad: Real = 0.01,
    }
    /// Arrivals of the samples of a channel.
    ARRIVALS: Arrivals {
        /// Number of mean gaps after which the last sample is stale. Chosen.
        timeout_gaps: Real = 3.0,
        /// Number of mean deviations of the gaps added to this time. Derived: the factor of Jacobson (1988).
        timeout_deviations: Real = 4.0,
        /// Shortest timeout, s. Chosen: a dozen lost samples of a fast channel are nothing to filters with a corner of
        /// 1 Hz.
        min_timeout_s: Real = 0.1,
        /// Number of gaps in their mean and deviation. Chosen.
        gap_memory: Real = 16.0,
    }
    /// Detection of another load after a standstill.
    STANDING_LOAD: StandingLoad {
        /// Largest sum of the difference and twice its standard deviation for an equal mass, as a share of the mass.
        /// Derived: a load that is another by less may pass for the same, within three standard deviations of the
        /// gear's efficiency (3.5 %).
        same_share: Real = 0.12,
    }
    /// Stuck detectors of channels and of the IMU.
    STUCK: Stuck {
        /// Number of consecutive repetitions above which a noisy channel is stuck. Chosen.
        max_repeats: u32 = 20,
        /// Number of changes per legitimate repetition, and without one, above which an instrument counts as noisy.
        /// Chosen.
        min_changes_per_repeat: u32 = 100,
    }
    /// The validity rule.
    VALIDITY: Validity {
        /// Rates at which the innovations of a state filter and of a regression count as independent, 1/s: what a force
        /// balance leaves out changes within a fraction of a second, the samples of a regression come once or twice a
        /// second. Chosen.
        independent_hz: [Real; 2] = [5.0, 1.0],
        /// Windowed NIS from which standard deviations are widened. Derived: the 99 % quantile of the 20 degrees of
        /// freedom of a window.
        inconsistent: Real = 1.9,
    }
    /// Error of the grade carried along the arm of the IMU.
    ARM: Arm {
        /// Predictions kept along the arm: a capacity. Chosen.
        places: usize = 4,
        /// Distance over which a large error is remembered, m. Chosen.
        memory_m: Real = 8.0,
        /// Share of the largest recent square that counts as a variance. Derived: an error that comes and goes with
        /// each transition peaks at twice its root mean square.
        peak: Real = 0.25,
    }
    /// Uncalibrated instruments.
    CALIBRATION: Calibration {
        /// Standard deviations of the biases up to which an instrument counts as calibrated, and above which as
        /// uncalibrated, m/s² and rad/s. Between the two it is doubted in proportion, so that no estimate jumps with
        /// what is told. Chosen: a larger one may as well be the pitch of the mount or an error of scale
        /// (`docs/notes/rail_fusion.md`).
        calibrated_sd: [Real; 2] = [0.03, 0.06],
        /// Standard deviation of the scale of an instrument that is not calibrated. Measured in
        /// `docs/notes/rail_fusion.md`, "Uncalibrated and shaken instruments".
        scale_sd: Real = 0.0075,
        /// Change of the pitch over which the scale counts as one error, rad. Chosen.
        ramp_rad: Real = 0.2,
        /// Non-orthogonality of its axes, rad. Measured in `docs/notes/rail_fusion.md`, as above.
        askew_rad: Real = 0.025,
        /// Bias of a calibrated accelerometer, m/s². Data sheet of a calibrated unit: 1 mg.
        accel_bias_mps2: Real = 0.00978,
        /// Bias of a calibrated gyro, rad/s. Data sheet of a calibrated unit: 0.5 °/h.
        gyro_bias_radps: Real = 2.424e-6,
    }
    /// Solution separation of the pitch.
    SEPARATION: Separation {
        /// Largest separation without a fault, rad. Chosen.
        nominal_rad: Real = 0.004,
        /// Change of the pitch over which all must agree until a contradiction no longer counts, rad. Chosen.
        excited_rad: Real = 0.01,
    }
    /// Heading by the integral of the yaw rate.
    HEADING: Heading {
        /// Scale error of a calibrated gyro and of its axes against each other. Chosen.
        scale: Real = 0.001,
    }
    /// Shocks of the accelerometer, and spikes of the gyro.
    SHOCK: Shock {
        /// Low-pass of |f| − g, s. Chosen: 0.1 s rejects the shocks of rail joints, too.
        norm_lag_s: Real = 0.4,
        /// Deviation of |f| from g after this low-pass above which the accelerometer is out of use, m/s². Chosen.
        norm_gate_mps2: Real = 0.35,
        /// Largest jump of the gyro that is not a spike, rad/s. Chosen.
        min_jump_radps: Real = 0.1,
    }
    /// The attitude filter: limits of its state, and times.
    ATTITUDE: Attitude {
        /// Standard deviation of the curvature when the gyro is lost, 1/m. Chosen.
        lost_curvature_sd_per_m: Real = 0.005,
        /// Largest speed that the state may have, m/s. Chosen.
        max_speed_mps: Real = 100.0,
        /// Largest standard deviations of the state, in its units. Chosen.
        max_sd: [Real; crate::models::attitude::N] = [10.0, 0.6, 0.6, 2.0, 2.0, 2.0, 0.1, 0.1, 0.3, 0.3, 0.1],
        /// Time without a wheel after which the variance of the speed grows by `reopen`, s. Chosen.
        coast_s: Real = 8.0,
        /// Growth of the variance of the speed after `coast_s` without a wheel, m²/s² per s. Chosen.
        reopen: Real = 1.0,
        /// Standard deviations of the lateral force's model on a rail and on a road, m/s². On a road the side slip
        /// makes it wrong by some hundredths of m/s² for as long as a turn lasts, and the roll that passes for it
        /// couples the yaw rate into the pitch. Chosen.
        lateral_sd_mps2: [Real; 2] = [0.05, 5.0],
        /// Coupling of turns of a road vehicle, rad. Chosen.
        road_coupling_rad: Real = 0.01,
        /// Standard deviation of v̇ at the first sample, m/s²: of a vehicle that stands, of one that runs on a rail,
        /// and on a road. Chosen.
        first_acceleration_sd_mps2: [Real; 3] = [0.02, 1.0, 2.5],
        /// Largest sines of the pitch and the roll at the start. Chosen.
        max_sines: [Real; 2] = [0.6, 0.3],
    }
    /// Vertical curvature of the rail by the gyro.
    CURVATURE: Curvature {
        /// Smoothing distance, m: in way, not in time, or a body that nods at a stop would leave a curvature of its
        /// own; its error is that of an arm shorter by as much. Chosen.
        memory_m: Real = 0.05,
    }
    /// Grade of the rail by the pitch of the body.
    SURVEY: Survey {
        /// Standard deviation of the pitch of the body against the rail, rad: its running wheels are springs. Chosen.
        model_sd_rad: Real = 0.0003,
        /// Error of the chord, as a share of the error of the grade carried ahead over the arm. Derived: for d²θ/ds² it
        /// is w²/6 against l²/2, a third where half the wheelbase w is the arm l.
        chord_share: Real = 1.0 / 3.0,
    }
    /// The effective grade.
    EFFECTIVE: Effective {
        /// Factor on acceleration over g, and on the swing, in that standard deviation: without it the error over drawn
        /// courses is 4 % larger. Chosen.
        force_motion: Real = 2.0,
        /// Share of a new block in the correction by force. Chosen.
        share: Real = 0.6,
        /// Standard deviation of a grade by the force of a block, beside noise and motion, rad. Chosen.
        force_sd_rad: Real = 0.002,
    }
    /// Blocks of the force balance.
    BLOCK: Blocks {
        /// Length of a part of a block, and time between two looks of the effective grade at the rail remembered (or
        /// `MEMORY.min_pitch_m`, whichever comes first), s. Chosen.
        substep_s: Real = 0.1,
        /// Noise of the acceleration of a block within the model's noise, m/s². Chosen.
        nominal_mps2: Real = 2.5e-3,
        /// Noise of the acceleration of a part within the model's noise, m/s². Chosen.
        nominal_part_mps2: Real = 0.01,
        /// Share of the brake above which a block is not used. Chosen.
        max_brake: Real = 0.002,
    }
    /// Filter of the force balance with a swinging load.
    BALANCE: Balance {
        /// Largest |ln L/L₀|. Chosen.
        max_length: Real = 0.5,
        /// Standard deviations of the swing after a load has been taken, rad and rad/s. Chosen.
        new_swing_sd: [Real; 2] = [0.06, 0.25],
        /// Share of the first variance of the resistance that another load adds. Chosen.
        reopen: Real = 0.1,
    }
    /// Blocks that wait, and the marks of the mass.
    QUEUE: Queue {
        /// Blocks kept that wait for rail; a capacity. Chosen.
        blocks: usize = 26,
        /// Number of standard deviations by which the force may jump between blocks. Chosen.
        jump_sd: Real = 8.0,
    }
    /// Load bank.
    BANK: Bank {
        /// Initial loads of new hypotheses and their standard deviations, as shares of the largest load. Chosen: closer
        /// together where they are light.
        loads: [[Real; 2]; 8] = [
            [0.03, 0.03],
            [0.10, 0.04],
            [0.19, 0.05],
            [0.31, 0.07],
            [0.46, 0.08],
            [0.62, 0.08],
            [0.78, 0.08],
            [0.94, 0.08],
        ],
        /// Number of hypotheses including new ones; a capacity. Derived: as many as the loads above are kept after a
        /// block, and as many are new.
        most: usize = 16,
        /// Rate of load changes while moving, 1/s. Chosen.
        hazard_hz: Real = 3e-5,
        /// Number of used blocks between two shares for another load. Chosen.
        share_blocks: u32 = 4,
        /// Share for another load after a standstill. Derived: a half, times a fifth by which a load that fits narrows,
        /// which the weights leave out.
        stand_share: Real = 0.1,
        /// Degrees of freedom of a residual. Chosen: heavy tails.
        freedom: Real = 3.0,
        /// Bhattacharyya distance below which two loads are the same. Chosen.
        same: Real = 0.1,
        /// Weight below which a hypothesis is forgotten. Chosen.
        least_weight: Real = 1e-12,
    }
    /// Torque monitor.
    TORQUE: Torque {
        /// Speed of the rim over which the gear's efficiency reverses, m/s. Chosen.
        blend_mps: Real = 0.0085,
        /// Share of a step of the command by which a motor with a lag of 0.07 s is late after this low-pass. Derived:
        /// e^(0.07/0.3) − 1.
        delay: Real = 0.25,
    }
    /// Conditions for reading the rail.
    SOURCE: TrainSource {
        /// Standard deviation of the speed up to which the covered distance is measured, m/s. Chosen.
        seen_speed_sd_mps: Real = 0.02,
        /// Standard deviation of sin θ + b/g of a calm instrument. Chosen.
        calm_sum_sd: Real = 0.003,
        /// Distance over which a bad reading disappears from the means under a train, m. Chosen.
        read_m: Real = 20.0,
        /// Standard deviation of sin θ + b/g up to which the rail is read: what is read badly is told with its doubt.
        /// Chosen.
        read_sum_sd: Real = 0.02,
    }
    /// The remembered rail.
    MEMORY: RailNodes {
        /// Nodes remembered: a capacity. Chosen.
        nodes: usize = 300,
        /// Smallest distance between nodes, and distance between two evaluations for the effective grade, m. Chosen.
        min_pitch_m: Real = 0.1,
        /// Distance remembered beyond the span of the train, m. Chosen.
        spare_m: Real = 36.0,
        /// Weight of the reading of a later visit. Chosen.
        revisit: Real = 0.3,
        /// Distance over which the gradient at the front end is computed, and the doubt of instruments that contradict
        /// each other is smoothed, m. Chosen.
        end_m: Real = 1.0,
        /// Distance over which this gradient is assumed to continue, m. Chosen.
        onward_m: Real = 3.0,
    }
}

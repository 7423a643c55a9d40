//! The structs in Rust are laid out as a C compiler lays out those of the header.

use core::mem::offset_of;
use monorig_c::{
    ABI, ALIGNMENT, Aid, Estimated, Input, Label, Mass, NominalVehicle, Parameter, Reason,
    SetParameter, Triple, Value, ValueOut,
};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// Lines `type size` and `type.field offset`: a line of C that prints each, and what Rust says.
#[derive(Default)]
struct Both {
    c: String,
    rust: String,
}

impl Both {
    fn size(&mut self, c_type: &str, size: usize) {
        writeln!(self.c, r#"printf("{c_type} %zu\n", sizeof({c_type}));"#).unwrap();
        writeln!(self.rust, "{c_type} {size}").unwrap();
    }

    fn field(&mut self, c_type: &str, field: &str, offset: usize) {
        let print = format!(r#"printf("{c_type}.{field} %zu\n", offsetof({c_type}, {field}));"#);
        writeln!(self.c, "{print}").unwrap();
        writeln!(self.rust, "{c_type}.{field} {offset}").unwrap();
    }

    fn number(&mut self, name: &str, number: u64) {
        writeln!(
            self.c,
            r#"printf("{name} %llu\n", (unsigned long long){name});"#
        )
        .unwrap();
        writeln!(self.rust, "{name} {number}").unwrap();
    }
}

macro_rules! layout {
    ($both:ident, $c:literal, $rust:ty { $($field:ident),* }) => {
        $both.size($c, size_of::<$rust>());
        $($both.field($c, stringify!($field), offset_of!($rust, $field));)*
    };
}

#[test]
fn the_header_and_rust_have_one_layout() {
    let mut both = Both::default();
    both.number("MONORIG_ABI", ABI.into());
    both.number("MONORIG_ALIGNMENT", ALIGNMENT as u64);
    both.size("monorig_reason", size_of::<Reason>());
    both.size("monorig_sample", size_of::<Value>());
    both.size("monorig_sample3", size_of::<Triple>());
    layout!(both, "monorig_label", Label { name, unit });
    layout!(both, "monorig_value", ValueOut { value, sd, valid });
    layout!(
        both,
        "monorig_input",
        Input {
            size,
            t_ns,
            dt_s,
            specific_force_mps2,
            angular_rate_radps,
            steering_angle_rad,
            inclination_rad,
            auxiliary,
            motor_torque_nm,
            wheel_speed_mps,
            clamp_pressure_mpa,
            command_clamp_pressure_mpa,
            command_brake,
            command_motor_torque_nm
        }
    );
    layout!(
        both,
        "monorig_estimate",
        Estimated {
            size,
            t_ns,
            total_mass_kg,
            grade_rad,
            effective_grade_rad,
            speed_mps,
            innovation,
            nis,
            moving,
            excited,
            saturated,
            total_mass_protection_kg,
            grade_protection_rad,
            effective_grade_protection_rad
        }
    );
    layout!(
        both,
        "monorig_carried_mass",
        Mass {
            places_m,
            mass_kg,
            depth_m
        }
    );
    layout!(
        both,
        "monorig_vehicle",
        NominalVehicle {
            size,
            drives,
            tare_kg,
            wheel_radius_m,
            gear_ratio,
            efficiency,
            rotating_mass_kg,
            running_resistance,
            mass_range_kg,
            mass_guess_kg,
            tare_span_m,
            load_span_m,
            imu_arm_m,
            accel_bias_sd_mps2,
            gyro_bias_sd_radps,
            has_layout,
            masses,
            load_places_m,
            swinging_tare_kg,
            hook_depth_m,
            below_chains_m,
            chain_m,
            longitudinal_stiffness_npm,
            imu_depth_m,
            load_share_of_resistance,
            has_road,
            drag_area_m2,
            air_density_kgpm3,
            front_axle_m,
            rear_axle_m,
            front_cornering_npr,
            rear_cornering_npr
        }
    );
    layout!(
        both,
        "monorig_parameter",
        Parameter {
            name,
            unit,
            doc,
            kind,
            otherwise,
            least,
            most,
            words
        }
    );
    layout!(
        both,
        "monorig_setting",
        SetParameter {
            name,
            kind,
            number,
            word
        }
    );
    layout!(
        both,
        "monorig_aid",
        Aid {
            innovation,
            innovation_variance,
            test_ratio,
            outcome
        }
    );

    let folder = tempfile::tempdir().unwrap();
    let (source, program) = (folder.path().join("layout.c"), folder.path().join("layout"));
    let includes = "#include <stddef.h>\n#include <stdio.h>\n#include \"monorig_estimator.h\"";
    std::fs::write(
        &source,
        format!("{includes}\nint main(void) {{\n{}return 0;\n}}\n", both.c),
    )
    .unwrap();
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let Some(mut cc) = monorig_testing::c_compiler() else {
        return;
    };
    cc.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"])
        .arg(header);
    assert!(
        cc.arg("-o")
            .arg(&program)
            .arg(&source)
            .status()
            .unwrap()
            .success()
    );
    let printed = Command::new(&program).output().unwrap();
    assert_eq!(String::from_utf8(printed.stdout).unwrap(), both.rust);
}

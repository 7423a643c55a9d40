//! The first look at files of loggers: rates, gaps, and the map that is proposed for them.

use monorig_logs::check::{Inspection, inspect, proposed_map};
use monorig_logs::read::ReadOptions;

#[test]
fn rate_jitter_gaps_and_a_map() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("drive.csv");
    let mut text = "t,ax,ay,az,speed [km/h]\n".to_owned();
    for i in 0..1000 {
        let t = f64::from(i) * 0.01 + if i >= 500 { 3.0 } else { 0.0 };
        text += &format!("{t:.3},0.5,{},9.81,3.6\n", f64::from(i % 7));
    }
    std::fs::write(&path, text).unwrap();
    let found = inspect(&path, &ReadOptions::default()).unwrap();
    let [table] = found.tables.as_slice() else {
        panic!()
    };
    assert_eq!((table.rows, table.gaps, table.backwards), (1000, 1, 0));
    assert!((table.rate_hz() - 100.0).abs() < 1e-9 && table.jitter_ns < 1.0);
    let ay = &table.columns[1];
    assert_eq!(
        (ay.name.as_str(), ay.min, ay.max, ay.values),
        ("ay", 0.0, 6.0, 1000)
    );
    let map = proposed_map(&[("log".into(), "drive.csv".into(), &found)]);
    has(
        &map,
        &[
            "columns: [ax, ay, az], unit: m/s2",
            "columns: ['speed [km/h]'], unit: km/h",
            "rate_hz: 100",
        ],
    );
}

/// The map for files of these names, titles and first values; the values stay.
fn proposed(files: &[(&str, &str, &str)]) -> String {
    let dir = tempfile::tempdir().unwrap();
    let all: Vec<(String, String, Inspection)> = files
        .iter()
        .map(|(file, titles, values)| {
            let path = dir.path().join(file);
            let row = |i: u32| format!("{:.2}{values}\n", 0.02 * f64::from(i));
            let rows: String = (0..50).map(row).collect();
            std::fs::write(&path, format!("{titles}\n{rows}")).unwrap();
            let found = inspect(&path, &ReadOptions::default()).unwrap();
            let (name, _) = file.split_once('.').unwrap();
            (name.to_owned(), (*file).to_owned(), found)
        })
        .collect();
    let files = all.iter().map(|(a, b, c)| (a.clone(), b.clone(), c));
    proposed_map(&files.collect::<Vec<_>>())
}

fn has(map: &str, lines: &[&str]) {
    for line in lines {
        assert!(map.contains(line), "{line} in\n{map}");
    }
}

/// Names, units in heads and files of one sensor each, in the ways of loggers.
#[test]
fn columns_in_the_ways_of_loggers() {
    let phone = proposed(&[
        (
            "Accelerometer.csv",
            "time,seconds_elapsed,z,y,x",
            ",0,9.81,0,0",
        ),
        ("Gravity.csv", "time,z,y,x", ",9.81,0,0"),
        ("Gyroscope.csv", "time,seconds_elapsed,z,y,x", ",0,0.01,0,0"),
        (
            "Location.csv",
            "time,speedAccuracy,speed,latitude",
            ",1,5,48",
        ),
    ]);
    has(
        &phone,
        &[
            "specific_force: {file: Accelerometer, columns: [x, y, z], unit: m/s2",
            "angular_rate: {file: Gyroscope, columns: [x, y, z], unit: rad/s",
            "wheel_speed: [{file: Location, columns: [speed], unit: m/s}]",
        ],
    );
    let heads = "Zeit [s],Geschwindigkeit [km/h],Beschleunigung X [g],Beschleunigung Y [g],Beschleunigung Z [g],\
        Drehrate X [°/s],Drehrate Y [°/s],Drehrate Z [°/s],Motormoment [Nm]";
    has(
        &proposed(&[("fahrt.csv", heads, ",36,0,0,1,0,0,0,50")]),
        &[
            "columns: ['Geschwindigkeit [km/h]'], unit: km/h",
            "columns: ['Beschleunigung X [g]', 'Beschleunigung Y [g]', 'Beschleunigung Z [g]'], unit: g",
            "columns: ['Drehrate X [°/s]', 'Drehrate Y [°/s]', 'Drehrate Z [°/s]'], unit: deg/s",
            "torque: ['Motormoment [Nm]'], unit: Nm",
        ],
    );
    let names = "time_s,WheelSpeedFL,WheelSpeedFR,imu_acc_x_mps2,imu_acc_y_mps2,imu_acc_z_mps2,imu_gyr_x_dps,\
        imu_gyr_y_dps,imu_gyr_z_dps,MotorTorque_Nm,SteeringWheelSpeed,EngineSpeed,VehicleSpeed";
    has(
        &proposed(&[("d.csv", names, ",90,90,0,0,9.8,1,1,1,5,0,900,90")]),
        &[
            "wheel_speed: [{columns: [WheelSpeedFL, WheelSpeedFR], unit: km/h}]",
            "columns: [imu_acc_x_mps2, imu_acc_y_mps2, imu_acc_z_mps2], unit: m/s2",
            "columns: [imu_gyr_x_dps, imu_gyr_y_dps, imu_gyr_z_dps], unit: deg/s",
            "torque: [MotorTorque_Nm], unit: Nm",
        ],
    );
    let ros = "%time,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,\
        field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z";
    has(
        &proposed(&[("imu.csv", ros, ",0,0,0,0,0,1.0")]),
        &[
            "columns: [field.linear_acceleration.x, field.linear_acceleration.y, field.linear_acceleration.z], unit: g",
            "columns: [field.angular_velocity.x, field.angular_velocity.y, field.angular_velocity.z], unit: rad/s",
        ],
    );
    let sides = "t,ax,ay,az,wx,wy,wz,velL,velR";
    has(
        &proposed(&[("r.csv", sides, ",0,0,9.8,0,0,0,1,1")]),
        &[
            "columns: [ax, ay, az]",
            "columns: [wx, wy, wz]",
            "columns: [velL, velR]",
        ],
    );
}

/// Altitude and position of a receiver make a reference of the slope where no slope is recorded.
#[test]
fn positions_are_a_reference_of_the_slope() {
    let log = (
        "log.csv",
        "t,v,latitude,longitude,altitude_m",
        ",1.5,51.5,7.2,80",
    );
    let line = "slope: {altitude: {column: altitude_m, latitude: latitude, longitude: longitude, unit: m, window_m: 20}, sd_deg: 1}";
    has(&proposed(&[log]), &[line]);
    let slope = (
        "log.csv",
        "t,v,slope_deg,latitude,longitude,altitude_m",
        ",1.5,0.1,51.5,7.2,80",
    );
    assert!(!proposed(&[slope]).contains("altitude: {"));
}

/// Three files make one map: the IMU, the four wheels without the steering, the torque, and the references.
#[test]
fn files_of_a_folder_make_one_map() {
    let speeds = "fl [km/h],fr [km/h],rl [km/h],rr [km/h],steering_wheel_speed,torque [Nm]";
    let map = proposed(&[
        (
            "imu.csv",
            "t,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z",
            ",0,0,9.8,0,0,0",
        ),
        ("can.csv", &format!("t,{speeds}"), ",9,9,9,9,5,100"),
        ("ref.csv", "t,slope_deg,mass_kg", ",2,1720"),
    ]);
    has(
        &map,
        &[
            "files: {imu: imu.csv, can: can.csv, ref: ref.csv}",
            "specific_force: {file: imu, columns: [acc_x, acc_y, acc_z], unit: m/s2",
            "wheel_speed: [{file: can, columns: ['fl [km/h]', 'fr [km/h]', 'rl [km/h]', 'rr [km/h]'], unit: km/h}]",
            "traction: {file: can, torque: ['torque [Nm]'], unit: Nm}",
            "slope: {file: ref, column: slope_deg, unit: deg",
            "mass: {kg: 1720, sd_kg: 34}",
        ],
    );
}

/// Of two accelerometers the one that shows gravity is taken.
#[test]
fn an_acceleration_without_gravity_is_no_specific_force() {
    let map = proposed(&[
        ("Accelerometer.csv", "time,z,y,x", ",0.1,0,0"),
        ("TotalAcceleration.csv", "time,z,y,x", ",9.8,0,0"),
    ]);
    has(
        &map,
        &["specific_force: {file: TotalAcceleration, columns: [x, y, z], unit: m/s2"],
    );
}

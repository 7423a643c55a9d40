//! Seeds and streams.

use super::*;

#[test]
fn the_same_seed_gives_the_same_bits_and_another_other_noise() {
    let train = train(2);
    let run = |seed| {
        look(
            &mut suite(&asset("liu2023.yaml"), &train, seed),
            |t| rolling(&train, t),
            DT,
            500,
        )
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
    let stamps = |seen: &[Measurements]| forces(seen).iter().map(|s| s.t.s()).collect::<Vec<_>>();
    assert_eq!(stamps(&run(5)), stamps(&run(6)));
}

#[test]
fn adding_or_removing_a_sensor_leaves_the_others_bit_identical() {
    let all = asset("huainan.yaml");
    let mut fewer = all.clone();
    fewer.remove("accelerometer");
    fewer.remove("motor_torque");
    let (two, three) = (train(2), train(3));
    let full = look(&mut suite(&all, &two, 5), |t| rolling(&two, t), DT, 2000);
    let less = look(&mut suite(&fewer, &two, 5), |t| rolling(&two, t), DT, 2000);
    let longer = look(
        &mut suite(&all, &three, 5),
        |t| rolling(&three, t),
        DT,
        2000,
    );
    for ((a, b), c) in full.iter().zip(&less).zip(&longer) {
        assert_eq!(a.angular_rate_radps, b.angular_rate_radps);
        assert_eq!(a.wheel_speed_mps, b.wheel_speed_mps);
        assert_eq!(a.clamp_pressure_mpa, b.clamp_pressure_mpa);
        assert_eq!(a.specific_force_mps2, c.specific_force_mps2);
        assert_eq!(a.wheel_speed_mps[..2], c.wheel_speed_mps[..2]);
        assert!(b.specific_force_mps2.is_none() && b.motor_torque_nm.iter().all(Option::is_none));
    }
}

use monorig_tests::*;
use monorig_sim::plant::Plant;
use nalgebra::Vector3;
fn main() {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let mut w = world(&train.clone().with_load_mass(10000.0).unwrap(), &rail, 20.0, 0.0);
    let mut cruise = Cruise::new(&train, 0.9);
    let t0 = std::time::Instant::now();
    let n = 50_000; let mut worst = 0.0;
    for k in 0..n { let c = cruise.command(&train, &w, 2e-3); w.step(&c, 2e-3).unwrap(); 
      if w.truth().off_rail_m > worst { worst = w.truth().off_rail_m; if k%5==0 { println!("off {:.4} at t {} s {} v {}", worst, w.truth().t_s, w.truth().chainage_m, w.truth().speed_mps); } } }
    println!("{:.2} us/step at {}", t0.elapsed().as_secs_f64()/n as f64*1e6, w.truth().chainage_m);
    let i = imu(&train); let dt=2e-3;
    let rail = slope(-15.0);
    let mut w = world(&train, &rail, 40.0, 0.5);
    let mut cruise = Cruise::new(&train, 0.5);
    let mut v = w.truth().mounts[i].v_w;
    for k in 0..20_000 { let c = cruise.command(&train, &w, dt); w.step(&c, dt).unwrap();
       let m = w.truth().mounts[i]; let f = (m.v_w - v)/dt + Vector3::z()*9.81; v = m.v_w;
       if k > 19_980 || (k<10000 && k%500==0) { println!("{k} v {:.4} f {:.5} {:.5} {:.5} T {:.3} {:.3} slip {:.5} w {:?}", w.truth().speed_mps, f.x,f.y,f.z, c.motor_torque_nm[0], w.truth().drives[0].motor_torque_nm, w.truth().drives[0].slip_mps,  w.truth().drives[0].wheel_rate_radps); }
    }
}

//! Controllers on UDP: run after run, their mistakes, and one that starts again.

use super::{numbers, registry, scenario, watch};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::StepFrame;
use monorig_sim::closed_loop::{Outcome, Simulation};
use monorig_wire::cannelloni;
use monorig_wire::ecu::Ecu;
use monorig_wire::frame::Frame;
use monorig_wire::message::{Message, Value};
use monorig_wire::signal::Numbers;
use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Changes the frames of an answer before a controller on UDP sends them.
type Tamper = dyn FnMut(u64, &mut Vec<Frame>) + Send;

/// A controller on UDP with one of our estimators, in a thread that ends with it. It starts again, with a socket and
/// an estimator of their own, before the step `restarts`.
struct Controller {
    address: String,
    over: Arc<AtomicBool>,
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

impl Controller {
    fn start(restarts: u64, mut tamper: Box<Tamper>) -> Self {
        let make = move || {
            let scenario = scenario("minimal.yaml", "{dffrls_aekf: {}}", "1");
            let vehicle = Simulation::build(scenario, &Registry::default(), 1)
                .unwrap()
                .vehicle;
            let built = Registry::default()
                .find_estimator("dffrls_aekf")
                .unwrap()
                .build(&vehicle, &[]);
            built.unwrap()
        };
        let mut socket = Some(UdpSocket::bind("127.0.0.1:0").unwrap());
        let address = socket.as_ref().unwrap().local_addr().unwrap();
        let over = Arc::new(AtomicBool::new(false));
        let ends = over.clone();
        std::thread::spawn(move || {
            let (mut ecu, mut estimator) = (Ecu::new(Numbers::Fixed), make());
            let (mut steps, mut bytes) = (0, [0; 65_536]);
            while !ends.load(Ordering::Relaxed) {
                let at = socket.get_or_insert_with(|| UdpSocket::bind(address).unwrap());
                at.set_read_timeout(Some(Duration::from_millis(100)))
                    .unwrap();
                let Ok((count, asker)) = at.recv_from(&mut bytes) else {
                    continue;
                };
                if steps == restarts {
                    steps += 1;
                    socket = None;
                    (ecu, estimator) = (Ecu::new(Numbers::Fixed), make());
                    std::thread::sleep(Duration::from_millis(300));
                    continue;
                }
                let mut frames = Vec::new();
                assert!(cannelloni::read(&bytes[..count], &mut |frame| {
                    ecu.take(estimator.as_mut(), frame, &mut |f| frames.push(*f));
                }));
                if frames.is_empty() {
                    continue;
                }
                tamper(steps, &mut frames);
                steps += 1;
                let mut datagram = cannelloni::begin(0).to_vec();
                frames
                    .iter()
                    .for_each(|f| cannelloni::write(f, &mut datagram));
                cannelloni::count(&mut datagram, frames.len() as u16);
                at.send_to(&datagram, asker).unwrap();
            }
        });
        let address = address.to_string();
        Self { address, over }
    }

    /// A run of two seconds with it.
    fn run(&self, see: &mut dyn FnMut(&StepFrame<'_>)) -> Result<Outcome, monorig_sim::Error> {
        let ecu = format!("{{ecu: {{external: {{udp: \"{}\"}}}}}}", self.address);
        watch(scenario("minimal.yaml", &ecu, "2"), &registry(), see)
    }

    /// The words of a run that breaks.
    fn breaks(tamper: Box<Tamper>) -> String {
        let controller = Self::start(u64::MAX, tamper);
        controller.run(&mut |_| {}).unwrap_err().to_string()
    }
}

/// The number of the step in a frame of an answer, changed.
fn renumbered(frame: &Frame, by: u16) -> Frame {
    let message = Message::of(frame.id).unwrap();
    let mut values: [Value; 8] = message.decode(Numbers::Fixed, frame).unwrap();
    for value in &mut values {
        if let Value::Sequence(sequence) = value {
            *sequence = (*sequence + by) % monorig_wire::SEQUENCES;
        }
    }
    message.encode(Numbers::Fixed, &values).0
}

/// Over UDP, with the same numbers as in the loop; and again, with the same controller.
#[test]
fn a_controller_on_udp_makes_run_after_run() {
    let controller = Controller::start(u64::MAX, Box::new(|_, _| {}));
    let mut runs = Vec::new();
    for _ in 0..2 {
        let mut all = Vec::new();
        let outcome = controller.run(&mut |f| all.extend(numbers(&f.estimators[0].estimate)));
        assert!(outcome.unwrap().refusals.is_empty());
        assert!(all.len() > 5000);
        runs.push(all.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
    }
    assert!(runs[0] == runs[1], "a run begins anew, whatever was before");
}

/// Each mistake of a controller ends the run with words of its own.
#[test]
fn mistakes_of_a_controller_have_messages() {
    let at = |step: u64, change: fn(&mut Vec<Frame>)| -> Box<Tamper> {
        Box::new(move |k, frames| {
            if k == step {
                change(frames);
            }
        })
    };
    let wrong = Controller::breaks(at(9, |all| {
        all.iter_mut().for_each(|f| *f = renumbered(f, 77));
    }));
    assert!(
        wrong.contains("answers step 86, but was given step 9"),
        "{wrong}"
    );
    let twice = Controller::breaks(at(9, |all| {
        let before: Vec<Frame> = all
            .iter()
            .map(|f| renumbered(f, monorig_wire::SEQUENCES - 1))
            .collect();
        all.splice(0..0, before);
    }));
    assert!(
        twice.contains("answers step 8 twice: two estimators may have"),
        "{twice}"
    );
    let half = Controller::breaks(at(9, |all| {
        all.remove(1);
    }));
    assert!(
        half.contains("answers step 9 without mass and grade"),
        "{half}"
    );
    let silent = Controller::breaks(Box::new(|k, all| {
        if k >= 9 {
            all.clear();
        }
    }));
    assert!(silent.contains("gives no answer within 2 s to"), "{silent}");
    for words in [wrong, twice, half, silent] {
        assert!(
            words.contains("the estimator ecu broke down at t = 0.0")
                && words.contains("127.0.0.1:"),
            "{words}"
        );
    }
}

/// A value that is no number refuses its step, as one of a library does.
#[test]
fn what_is_no_number_is_refused() {
    let nan = |k: u64, all: &mut Vec<Frame>| {
        if k % 10 == 9 {
            let mut values: [Value; 8] = Message::Grade.decode(Numbers::Fixed, &all[1]).unwrap();
            values[0] = Value::Number(f64::NAN);
            all[1] = Message::Grade.encode(Numbers::Fixed, &values).0;
        }
    };
    let controller = Controller::start(u64::MAX, Box::new(nan));
    let mut steps = 0;
    let outcome = controller.run(&mut |_| steps += 1).unwrap();
    let [(_, times, reason)] = &outcome.refusals[..] else {
        panic!("{:?}", outcome.refusals)
    };
    assert_eq!(*times, steps / 10);
    assert!(reason.contains("grade_rad is NaN"), "{reason}");
}

/// A controller that starts again in the middle is sent its step again, and goes on; that is counted.
#[test]
fn a_controller_that_starts_again_goes_on() {
    let controller = Controller::start(200, Box::new(|_, _| {}));
    let (mut again, mut began) = (0.0, 0.0);
    let outcome = controller.run(&mut |frame| {
        [again, began] = frame.estimators[0]
            .internals_named(["sent_again", "began_again"])
            .map(Option::unwrap);
    });
    assert!(outcome.unwrap().refusals.is_empty());
    assert!(again >= 1.0, "{again}");
    assert_eq!(began, 1.0);
}

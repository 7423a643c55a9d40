//! Nobody at the other end, a program that hangs, ends or sends something else.

use super::{registry, scenario, watch};
use monorig_testing::tools;
use std::net::UdpSocket;
use std::time::{Duration, Instant};

/// Nobody at the other end, two runs at one address, a program that hangs, ends, or sends something else.
#[test]
fn what_goes_wrong_at_the_other_end_is_told() {
    if !tools(&["sh", "sleep", "cat", "yes", "tr"]) {
        return;
    }
    let free = UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let broken = |ecu: &str| {
        let estimators = format!("{{ecu: {{external: {ecu}}}}}");
        let begun = Instant::now();
        let ran = watch(
            scenario("minimal.yaml", &estimators, "2"),
            &registry(),
            &mut |_| {},
        );
        assert!(begun.elapsed() < Duration::from_secs(8), "{ecu}");
        ran.err()
            .unwrap_or_else(|| panic!("{ecu} works"))
            .to_string()
    };
    for (ecu, told) in [
        (
            &*format!("{{udp: \"{free}\"}}"),
            "gives no answer within 2 s to",
        ),
        (
            "{process: [sleep, \"60\"], start_s: 0.5}",
            "sleep gives no answer within 0.5 s to step 0 (up to 220): flush each answer, or set `start_s`",
        ),
        (
            "{process: [sh, -c, exit 3]}",
            "sh ended its process: exit status: 3",
        ),
        ("{process: [sh, -c, kill -9 $$]}", "sh crashed: signal 9"),
        (
            "{process: [sh, -c, echo hello; sleep 9]}",
            "sh sends `hello`, which is not a frame of candump",
        ),
        (
            "{process: [sh, -c, yes | tr -d '\\n']}",
            "sh sends a line of more than",
        ),
        // what it is sent is none of an answer
        (
            "{process: [cat], start_s: 1}",
            "cat gives no answer within 1 s to",
        ),
    ] {
        let words = broken(ecu);
        assert!(words.contains(told), "{words}");
    }
    let both =
        format!("{{a: {{external: {{udp: \"{free}\"}}}}, b: {{external: {{udp: \"{free}\"}}}}}}");
    let two = watch(
        scenario("minimal.yaml", &both, "1"),
        &registry(),
        &mut |_| {},
    );
    let two = two.err().unwrap().to_string();
    assert!(two.contains("can make one run at a time"), "{two}");
}

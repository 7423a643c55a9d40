//! Ctrl-C: the first stops the command in good order, the second at once.

use crate::ui::note::note;
use monorig_sim::interrupt;

/// Listens for Ctrl-C from now on.
pub fn listen() {
    let on_signal = || {
        if interrupt::request() {
            std::process::exit(130);
        }
    };
    // it panics if the system does not make a thread for it
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let handler = std::panic::catch_unwind(|| ctrlc::set_handler(on_signal));
    std::panic::set_hook(hook);
    let why = match handler {
        Ok(Ok(())) => return,
        Ok(Err(e)) => e.to_string(),
        Err(_) => "the system did not make a thread".to_owned(),
    };
    note(&format!("Ctrl-C will end the program at once: {why}"));
}

/// Returns false once Ctrl-C was pressed.
pub fn go_on() -> bool {
    !interrupt::requested()
}

//! A process that this program starts and ends, with its child processes.

use monorig_sim::interrupt;
use rustix::process::{Pid, Signal, kill_process_group};
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus};
use std::time::Duration;

/// Time for a process to end by itself after its last task.
const TO_END: Duration = Duration::from_secs(1);
/// Largest memory of the process and of each child process, bytes.
#[cfg(target_os = "linux")]
const MAX_MEMORY: u64 = 4 << 30;

/// A process that ends with its owner.
pub(crate) struct OwnedProcess(Child);

impl OwnedProcess {
    /// Starts it.
    pub fn start(command: &mut Command) -> io::Result<Self> {
        // Ctrl-C is for the program, which then asks for nothing more
        let started = Self(command.process_group(0).spawn()?);
        #[cfg(target_os = "linux")]
        {
            use rustix::process::{Resource, Rlimit, prlimit};
            let most = Rlimit {
                current: Some(MAX_MEMORY),
                maximum: Some(MAX_MEMORY),
            };
            prlimit(Some(started.pid()), Resource::Data, most)?;
        }
        Ok(started)
    }

    fn pid(&self) -> Pid {
        Pid::from_child(&self.0)
    }

    /// Waits until the process ends by itself; else kills it and returns no status.
    pub fn end(&mut self) -> Option<ExitStatus> {
        for _ in 0..TO_END.as_millis() {
            if let Ok(Some(status)) = self.0.try_wait() {
                self.kill();
                return Some(status);
            }
            if interrupt::requested() {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        self.kill();
        None
    }

    /// Ends the process and its child processes at once.
    pub fn kill(&mut self) {
        // errors say that they have ended already
        let _ = kill_process_group(self.pid(), Signal::KILL);
        let _ = self.0.wait();
    }
}

impl Drop for OwnedProcess {
    fn drop(&mut self) {
        self.end();
    }
}

/// The end of a process that should not have ended, in words.
pub(crate) fn ended(status: ExitStatus) -> String {
    let told = status.to_string();
    match status.signal() {
        // whether there is a core depends on the machine
        Some(_) => {
            let told = told.trim_end_matches(" (core dumped)");
            format!("crashed: {}", told.replacen("signal: ", "signal ", 1))
        }
        None => format!("ended its process: {told}"),
    }
}

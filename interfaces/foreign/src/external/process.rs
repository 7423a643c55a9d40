//! Lines of candump through the standard input and output of a process.

use super::link::Link;
use crate::owned_process::{OwnedProcess, ended};
use monorig_sim::closed_loop::registry::Refusal;
use monorig_wire::candump;
use monorig_wire::frame::Frame;
use std::io::{self, ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Time for an answer before the step is sent again, and for the process to read its input.
const WAIT: Duration = Duration::from_millis(500);
const WRITE: Duration = Duration::from_secs(2);
/// Largest number of bytes of a line that is read, and of a wrong line that is shown.
const MAX_LINE: usize = 4096;
const SHOWN: usize = 24;
/// Longest name of a program in a message, characters.
const LONGEST_NAME: usize = 30;

/// A process that reads frames.
pub(super) struct Process {
    program: PathBuf,
    words: Vec<String>,
    folder: PathBuf,
    name: String,
    running: Option<StartedProcess>,
    out: Vec<u8>,
}

/// A process that has been started.
struct StartedProcess {
    socket: UnixStream,
    child: OwnedProcess,
    /// Bytes behind the last whole line.
    rest: Vec<u8>,
}

impl Drop for StartedProcess {
    fn drop(&mut self) {
        // its process ends once nothing more comes
        let _ = self.socket.shutdown(Shutdown::Both);
    }
}

/// Finds the program: a path from the folder, or a word in `PATH`.
pub(super) fn find(words: &[String], folder: &Path) -> Result<PathBuf, Refusal> {
    let name = words.first().map(String::as_str).unwrap_or_default();
    let is_path = name.contains('/');
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let mut places: Vec<PathBuf> = match is_path {
        true => vec![folder.join(name)],
        false => std::env::split_paths(&folders)
            .map(|at| at.join(name))
            .collect(),
    };
    let found = places.iter().position(|at| at.is_file());
    let found = found.map(|k| places.swap_remove(k));
    let found = found.ok_or_else(|| {
        let help = match is_path {
            true => "use a path from the folder of the scenario, or an absolute path",
            false => "use a program in PATH; `./NAME` is a program beside the scenario",
        };
        Refusal::new(format!("the program `{name}` does not exist"), help)
    })?;
    // the process starts in another folder
    Ok(std::path::absolute(&found).unwrap_or(found))
}

impl Process {
    /// A process of this program with its arguments, which starts in the folder when it is needed.
    pub fn new(words: &[String], folder: &Path) -> Result<Self, Refusal> {
        let program = find(words, folder)?;
        let name = program.file_name().unwrap_or_default().to_string_lossy();
        Ok(Self {
            name: name.chars().take(LONGEST_NAME).collect(),
            words: words.get(1..).unwrap_or_default().to_vec(),
            folder: match folder.as_os_str().is_empty() {
                true => ".".into(),
                false => folder.into(),
            },
            program,
            running: None,
            out: Vec::new(),
        })
    }

    fn start(&self) -> io::Result<StartedProcess> {
        let (ours, theirs) = UnixStream::pair()?;
        ours.set_read_timeout(Some(WAIT))?;
        ours.set_write_timeout(Some(WRITE))?;
        let mut command = Command::new(&self.program);
        command.args(&self.words).current_dir(&self.folder);
        command.stdin(OwnedFd::from(theirs.try_clone()?));
        command.stdout(OwnedFd::from(theirs));
        Ok(StartedProcess {
            child: OwnedProcess::start(&mut command)?,
            socket: ours,
            rest: Vec::new(),
        })
    }

    /// The process, started if it is not.
    fn running(&mut self) -> Result<&mut StartedProcess, String> {
        if self.running.is_none() {
            let started = self
                .start()
                .map_err(|e| format!("cannot be started: {e}"))?;
            self.running = Some(started);
        }
        self.running.as_mut().ok_or_else(String::new)
    }
}

impl StartedProcess {
    /// Returns the reason why no more lines come.
    fn over(&mut self) -> String {
        let _ = self.socket.shutdown(Shutdown::Both);
        match self.child.end() {
            Some(status) => ended(status),
            None => "closes its standard output".to_owned(),
        }
    }

    /// Passes on the frames of the complete lines.
    fn lines(&mut self, each: &mut dyn FnMut(&Frame)) -> Result<(), String> {
        let Some(end) = self.rest.iter().rposition(|c| *c == b'\n') else {
            return match self.rest.len() > MAX_LINE {
                true => Err(format!("sends a line of more than {MAX_LINE} bytes")),
                false => Ok(()),
            };
        };
        for line in self
            .rest
            .get(..end)
            .unwrap_or_default()
            .split(|c| *c == b'\n')
        {
            if line.trim_ascii().is_empty() {
                continue;
            }
            match candump::read(line) {
                Some(read) => read.frame.iter().for_each(&mut *each),
                None => {
                    let line = String::from_utf8_lossy(line);
                    let shown: String = line.trim().chars().take(SHOWN).collect();
                    return Err(format!("sends `{shown}`, which is not a frame of candump"));
                }
            }
        }
        self.rest.drain(..=end);
        Ok(())
    }
}

impl Link for Process {
    fn at(&self) -> &str {
        &self.name
    }

    fn begin(&mut self) {
        self.out.clear();
    }

    fn put(&mut self, frame: &Frame, ns: i64) {
        candump::write(frame, ns, &mut self.out);
    }

    fn send(&mut self) -> Result<(), String> {
        let out = std::mem::take(&mut self.out);
        let running = self.running()?;
        let sent = running.socket.write_all(&out).map_err(|e| match e.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                format!("has not read its standard input for {} s", WRITE.as_secs())
            }
            _ => running.over(),
        });
        self.out = out;
        sent
    }

    fn never_wait(&mut self) -> Result<(), String> {
        let set = self.running()?.socket.set_nonblocking(true);
        set.map_err(|e| format!("cannot be read: {e}"))
    }

    fn receive(&mut self, each: &mut dyn FnMut(&Frame)) -> Result<bool, String> {
        let running = self.running()?;
        let mut bytes = [0; 8192];
        match running.socket.read(&mut bytes) {
            Ok(0) => Err(running.over()),
            Ok(count) => {
                running
                    .rest
                    .extend_from_slice(bytes.get(..count).unwrap_or_default());
                running.lines(each)?;
                Ok(true)
            }
            Err(e) => match e.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(false),
                _ => Err(running.over()),
            },
        }
    }
}

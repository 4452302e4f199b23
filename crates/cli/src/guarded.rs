//! The second line of defence against damaged files: a child process.
//!
//! A command whose input is decoded by a library (LAZ, E57, glTF) runs in a child process, with
//! limited memory while it reads. The first line of defence is `nearmiss::io`, which checks sizes
//! and counts before the library sees a byte. If the library still ends the process, for example
//! because memory runs out, the parent prints an error with the name of the file.

use std::env;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode, ExitStatus};

use nearmiss::io::{Format, format_of};

use crate::console;

/// The environment variable that is set in the child.
const IN_CHILD: &str = "NEARMISS_IN_CHILD";

/// The exit status after Ctrl-C, by the convention of shells.
#[cfg(unix)]
const INTERRUPTED: u8 = 130;

/// Runs this program again in a child process if one of the inputs is decoded by a library. Returns
/// `None` if this process has to do the work: in the child, for all other inputs, and if no child
/// can be started.
pub(crate) fn run_in_child(args: &[OsString], inputs: &[&Path]) -> Option<ExitCode> {
    if env::var_os(IN_CHILD).is_some() {
        end_with_parent();
        return None;
    }
    let file = inputs.iter().find(|path| is_decoded_by_library(path))?;
    let mut command = Command::new(env::current_exe().ok()?);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::arg0(&mut command, args.first()?);
    let status = command.args(args.get(1..)?).env(IN_CHILD, "1").status().ok()?;
    Some(exit_code(status, file))
}

fn is_decoded_by_library(path: &Path) -> bool {
    matches!(format_of(path), Ok(Format::Las | Format::E57 | Format::Gltf))
}

/// Returns the exit status of the child, or prints an error if a signal has ended it.
fn exit_code(status: ExitStatus, file: &Path) -> ExitCode {
    if let Some(code) = status.code() {
        return ExitCode::from(u8::try_from(code).unwrap_or(1));
    }
    #[cfg(unix)]
    if std::os::unix::process::ExitStatusExt::signal(&status) == Some(signal_hook::consts::SIGINT) {
        return ExitCode::from(INTERRUPTED);
    }
    console::say_error(format_args!(
        "{}: expected a file that can be decoded, got a crash of the decoder ({status}); export the \
         file again if it is damaged, or free some memory (the output is unchanged)",
        file.display()
    ));
    ExitCode::FAILURE
}

/// Makes the system end this child when its parent ends.
fn end_with_parent() {
    #[cfg(target_os = "linux")]
    let _asked = rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL));
}

/// The bytes that a child may allocate while it reads, in addition to the expected ones.
#[cfg(target_os = "linux")]
const SPARE: f64 = 512e6;

/// A limit on the memory of a child, which applies until it is dropped.
#[derive(Debug)]
pub(crate) struct ReadingLimit {
    #[cfg(target_os = "linux")]
    before: Option<rustix::process::Rlimit>,
}

impl ReadingLimit {
    /// Limits the memory that a child may allocate to some 500 MB more than `expected` returns, in bytes.
    /// Does nothing outside a child, and on systems other than Linux.
    pub(crate) fn new(expected: impl FnOnce() -> f64) -> Self {
        #[cfg(target_os = "linux")]
        {
            use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

            let set = || {
                env::var_os(IN_CHILD)?;
                let before = getrlimit(Resource::Data);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative")]
                let most = allocated()?.saturating_add((expected() + SPARE) as u64);
                let current = Some(before.current.map_or(most, |current| current.min(most)));
                setrlimit(Resource::Data, Rlimit { current, maximum: before.maximum }).ok()?;
                Some(before)
            };
            Self { before: set() }
        }
        #[cfg(not(target_os = "linux"))]
        {
            let _unlimited = expected;
            Self {}
        }
    }
}

#[cfg(target_os = "linux")]
impl Drop for ReadingLimit {
    fn drop(&mut self) {
        if let Some(before) = self.before.take() {
            let _lifted = rustix::process::setrlimit(rustix::process::Resource::Data, before);
        }
    }
}

/// Returns the bytes of memory that the process has allocated, without mapped files.
#[cfg(target_os = "linux")]
fn allocated() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmData:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

//! A clear answer where the system can give none: a mapped file that another program cuts short while it is
//! read, or whose disk fails, ends the process by a signal.

/// What is said then.
#[cfg(unix)]
const CAUSE: &[u8] =
    b"error: a file was cut short while it was read, or its disk failed: expected prepared scans to \
stay as they are; prepare the scan again, and replace files in one step, as `preprocess` does\n";

/// Says on standard error what has happened, and ends the process with status 1.
#[cfg(unix)]
#[expect(unsafe_code, reason = "what runs in a signal may do very little")]
pub(crate) fn tell_of_lost_files() {
    let tell = || {
        let _said = rustix::io::write(rustix::stdio::stderr(), CAUSE);
        signal_hook::low_level::exit(1);
    };
    // SAFETY: the handler writes some bytes that are there already and ends the process; both are allowed in
    // signals, and nothing is allocated, locked or unwound.
    let _registered = unsafe { signal_hook::low_level::register(signal_hook::consts::SIGBUS, tell) };
}

#[cfg(not(unix))]
pub(crate) fn tell_of_lost_files() {}

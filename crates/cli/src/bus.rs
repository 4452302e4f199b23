//! An error message in place of `SIGBUS`, the signal that ends the process if a mapped file is
//! truncated while it is read, or if its disk fails.

/// The message.
#[cfg(unix)]
const CAUSE: &[u8] =
    b"error: a prepared file was cut short while it was read, or its disk failed; prepare it again, and \
replace files in one step, as `preprocess` does\n";

/// Installs a handler that prints the message on standard error and ends the process with status 1.
#[cfg(unix)]
#[expect(unsafe_code, reason = "what runs in a signal may do very little")]
pub(crate) fn tell_of_lost_files() {
    let tell = || {
        let _said = rustix::io::write(rustix::stdio::stderr(), CAUSE);
        signal_hook::low_level::exit(1);
    };
    // SAFETY: the handler writes static bytes and ends the process. Both are allowed in signal
    // handlers, and nothing is allocated, locked or unwound.
    let _registered = unsafe { signal_hook::low_level::register(signal_hook::consts::SIGBUS, tell) };
}

#[cfg(not(unix))]
pub(crate) fn tell_of_lost_files() {}

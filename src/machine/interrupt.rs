//! Owns what happens at Ctrl-C: the program ends at once, and says how to go on. Files are written whole or not at all
//! ([`crate::io::atomic`]), so nothing is half done.

/// Exit code of a program that an interrupt ended.
#[cfg(unix)]
const INTERRUPTED: i32 = 130;

#[cfg(unix)]
const WORDS: &[u8] =
    b"\nnote: stopped. What is finished is kept: the same command goes on from there (--force starts again). Of a run, answers.csv and the page come at its end; `bonepd-ct report FOLDER -o OUT` makes them now\n";

/// To be called once, by commands that keep what they have finished.
#[cfg(unix)]
pub fn say_how_to_go_on() {
    extern "C" fn stop(_: libc::c_int) {
        // SAFETY: `write` and `_exit` may be called in a signal handler; the buffer is static.
        unsafe {
            libc::write(libc::STDERR_FILENO, WORDS.as_ptr().cast(), WORDS.len());
            libc::_exit(INTERRUPTED);
        }
    }
    let handler: extern "C" fn(libc::c_int) = stop;
    // SAFETY: the handler calls only what a signal handler may.
    unsafe {
        libc::signal(libc::SIGINT, handler as libc::sighandler_t);
    }
}

#[cfg(not(unix))]
pub fn say_how_to_go_on() {}

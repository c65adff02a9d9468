//! Owns what happens at Ctrl-C: the program ends at once, and says how to go on. Files are written whole or not at all
//! ([`crate::io::atomic`]), so nothing is half done. A program that calls the library goes on itself: it asks a computation to stop.

use crate::system;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A wish to stop: one thread has it, the one that computes sees it.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

/// What a computation that was stopped unwinds with.
pub struct Stopped;

impl Stop {
    /// Asks the computation to stop at its next iteration.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Unwinds the calling thread with [`Stopped`] once it was asked. No message is printed.
    pub fn obey(&self) {
        if self.is_asked() {
            resume_unwind(Box::new(Stopped));
        }
    }
}

/// Exit code of a program that an interrupt ended.
const INTERRUPTED: i32 = 130;

const WORDS: &str = "\nnote: stopped. What is finished is kept: the same command goes on from there (--force starts again). Of a run, answers.csv and the page come at its end; `bonepd-ct report FOLDER -o OUT` makes them now\n";

/// To be called once, by commands that keep what they have finished.
pub fn say_how_to_go_on() {
    system::at_interrupt(WORDS, INTERRUPTED);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::catch_unwind;

    #[test]
    fn what_is_asked_to_stop_unwinds_at_its_next_look() {
        let stop = Stop::default();
        stop.obey();
        stop.clone().ask();
        let unwound = catch_unwind(|| stop.obey()).unwrap_err();
        assert!(unwound.is::<Stopped>());
    }
}

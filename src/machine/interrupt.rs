//! Owns what happens at Ctrl-C: the program ends at once, and says how to go on. Files are written whole or not at all
//! ([`crate::io::atomic`]), so nothing is half done.

use crate::system;

/// Exit code of a program that an interrupt ended.
const INTERRUPTED: i32 = 130;

const WORDS: &str = "\nnote: stopped. What is finished is kept: the same command goes on from there (--force starts again). Of a run, answers.csv and the page come at its end; `bonepd-ct report FOLDER -o OUT` makes them now\n";

/// To be called once, by commands that keep what they have finished.
pub fn say_how_to_go_on() {
    system::at_interrupt(WORDS, INTERRUPTED);
}

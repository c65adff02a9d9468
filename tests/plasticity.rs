//! Tissue that yields: the laws at a point, bodies against closed forms and themselves, CalculiX, the command.

mod bodies;
mod calculix;
mod closed_forms;
mod command;
mod hard;
mod points;
mod stated;

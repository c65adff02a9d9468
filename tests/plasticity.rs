//! Tissue that yields: the laws at a point, bodies against closed forms, CalculiX, the command.

mod bodies;
mod calculix;
mod command;
mod points;

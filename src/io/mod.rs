//! How files are written: whole or not at all ([`atomic`]), and tables of records ([`table`]).

pub mod atomic;
pub mod own_files;
pub mod table;

//! How files are written: whole or not at all ([`atomic`]), and tables of records ([`table`]); how shares of one are ([`percent`]).

pub mod atomic;
pub mod own_files;
pub mod percent;
pub mod table;

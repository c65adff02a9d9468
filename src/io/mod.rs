//! How files are written: whole or not at all ([`atomic`]), and tables of records ([`table`]); names of files in
//! files ([`named`]); how shares of one are ([`percent`]).

pub mod atomic;
pub mod named;
pub mod own_files;
pub mod percent;
pub mod table;

//! The anisotropic continuum-molecular model (Diana, Arch. Comput. Methods Eng. 30 (2023) 1305-1344): oriented points
//! of a plane body joined by pair potentials. Equation numbers in this folder are that paper's; where its print is
//! wrong the docstring says so.
//!
//! Everything here is per unit thickness (h = 1 mm); loads, energies and currents of a body of thickness h are h times
//! as large. Angles are in radians, anticlockwise from e1.

pub mod attenuation;
pub mod body;
pub mod bond;
pub mod conductivity;
pub mod cosine;
pub mod crack_tip;
pub mod elastic_law;
pub mod micromoduli;
pub mod piezoresistance;
pub mod small;
pub mod tensor;
pub mod tetrachiral;
pub mod thermal;
pub mod toughness;

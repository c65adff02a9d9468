//! Owns the apparent modulus of a solved specimen, `E_app = K L / A` (Zojaji et al. 2024, eq 1), three ways.

/// What the solved specimen was and bore. mm and N.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Loaded {
    /// Distance of the innermost gripped planes.
    pub gauge_mm: f64,
    /// Cross-section of the volume of interest, pores included.
    pub area_mm2: f64,
    /// Displacement of one grip against the other along the load axis.
    pub displacement_mm: f64,
}

impl Loaded {
    /// From the reaction force of the moving grip: `F L_g / (A u)`. Off to first order in the algebraic error.
    pub fn from_reaction(&self, force_n: f64) -> f64 {
        force_n * self.gauge_mm / (self.area_mm2 * self.displacement_mm)
    }

    /// From twice the elastic energy `uᵀKu`: `2U L_g / (A u²)`. Off to second order, never below the exact value.
    pub fn from_energy(&self, twice_energy_nmm: f64) -> f64 {
        twice_energy_nmm * self.gauge_mm / (self.area_mm2 * self.displacement_mm.powi(2))
    }

    /// From the virial `Σ V_i σ_i` along the load axis: `Σ V_i σ_i / (A L_g ε)`.
    pub fn from_virial(&self, virial_nmm: f64) -> f64 {
        virial_nmm / (self.area_mm2 * self.displacement_mm)
    }
}

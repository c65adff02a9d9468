//! Owns the apparent modulus of a solved specimen, `E_app = K L / A` (Zojaji et al. 2024, eq 1), three ways, and the force or
//! moment that moves its ends.

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

/// What moves the ends: a force or a moment, magnitudes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EndWork {
    /// Along the ends' displacement; None under bending and torsion.
    pub force_n: Option<f64>,
    /// Force over displacement.
    pub stiffness_n_per_mm: Option<f64>,
    /// About the axis of the ends' turn; under bending the mean of both ends. None under forces.
    pub moment_nmm: Option<f64>,
    /// Estimated algebraic error of these, over their value.
    pub relative_error: f64,
}

impl EndWork {
    /// From twice the elastic energy `uᵀKu = F u` of ends that come nearer, part or slide by `displacement_mm`. Off to second
    /// order in the algebraic error.
    pub fn of_displacement(
        twice_energy_nmm: f64,
        displacement_mm: f64,
        relative_error: f64,
    ) -> Self {
        let stiffness = twice_energy_nmm / displacement_mm.powi(2);
        EndWork {
            force_n: Some((stiffness * displacement_mm).abs()),
            stiffness_n_per_mm: Some(stiffness),
            moment_nmm: None,
            relative_error,
        }
    }

    /// The same of ends that turn against each other by `turn` (radians; of a tilt twice its tangent): `uᵀKu = M turn`.
    pub fn of_turn(twice_energy_nmm: f64, turn: f64, relative_error: f64) -> Self {
        EndWork {
            moment_nmm: Some((twice_energy_nmm / turn).abs()),
            relative_error,
            ..EndWork::default()
        }
    }
}

//! Owns the recipe file: all stages parameters.

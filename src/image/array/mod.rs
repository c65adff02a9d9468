//! Arrays of voxels whose files know nothing of their size in the world.

pub mod headerless;
pub mod npy;

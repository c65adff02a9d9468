//! Specimens of the benches: phantoms of struts, and the stack of slices that `BONEPD_STACK` names.

use bonepd_ct::command::segment::in_memory;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::phantom::{PhantomParams, scan, structure};
use bonepd_ct::pipeline::segment::{SegmentParams, segment};
use bonepd_ct::volume::{Specimen, Volume};
use std::path::Path;

/// The bone of a phantom at the half level of its grey values.
pub fn phantom(params: &PhantomParams) -> Specimen {
    let grey = scan(&mut structure(params).expect("a phantom"), params);
    let values = grey.as_slice().iter().map(|&v| f32::from(v)).collect();
    let grey = Volume::from_vec(grey.grid, values);
    let window = SegmentParams {
        lower: Some(200.0),
        ..SegmentParams::default()
    };
    segment("phantom", &grey, &window, None)
        .expect("bone")
        .specimen
}

/// The real stack: threshold 63 after a Gaussian of one voxel.
pub fn real(stack: &Path) -> Specimen {
    let window = SegmentParams {
        spacing_mm: Some([0.0195; 3]),
        gaussian_voxels: 1.0,
        lower: Some(63.0),
        ..SegmentParams::default()
    };
    in_memory(stack, None, &window, &Session::default()).expect("a stack of slices")
}

//! Masks of other files on scans that lie any way in the world: each voxel of the mask on its voxel of the scan.

use super::write::{Order, Page, tiff};
use bonepd_ct::format::orient::{Affine, Turn, turned};
use bonepd_ct::grid::Grid;
use bonepd_ct::image::{nifti, scan};
use bonepd_ct::pipeline::segment::laid;
use bonepd_ct::volume::Volume;
use std::path::{Path, PathBuf};

const N: [usize; 3] = [5, 4, 3];
const H: [f64; 3] = [0.02, 0.03, 0.05];

/// A scan whose stored axes go this way in the world, each voxel of another value.
fn scan_of(dir: &Path, turn: &Turn) -> PathBuf {
    let path = dir.join("scan.nii");
    nifti::write(&path, &placed(turn, |i| i as f32)).unwrap();
    path
}

/// Values by their index as stored, at a place in the world.
fn placed(turn: &Turn, value: impl Fn(usize) -> f32) -> Volume<f32> {
    let mut volume = Volume::from_vec(Grid::new(N, H), (0..60).map(value).collect());
    volume.affine = Some(affine(turn, [1.0, -2.0, 3.0]));
    volume
}

fn affine(turn: &Turn, origin: [f64; 3]) -> Affine {
    std::array::from_fn(|world| {
        let mut row = [0.0, 0.0, 0.0, origin[world]];
        let stored = turn.from[world];
        row[stored] = if turn.reversed[world] {
            -H[stored]
        } else {
            H[stored]
        };
        row
    })
}

fn turns() -> Vec<Turn> {
    let axes = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let signs = (0..8).map(|s| std::array::from_fn(|a| s >> a & 1 == 1));
    axes.into_iter()
        .flat_map(|from| signs.clone().map(move |reversed| Turn { from, reversed }))
        .collect()
}

/// Values of the scan, of the mask, and notes.
type Laid = (Vec<f32>, Vec<f32>, Vec<String>);

/// What a mask of these stored values is on the scan.
fn lay(scan: &Path, mask: &Path) -> Result<Laid, String> {
    let scan = scan::read(scan, None).unwrap();
    let mut notes = Vec::new();
    let mask = laid::on(&scan, mask, &mut notes).map_err(|e| e.to_string())?;
    assert_eq!(mask.grid, scan.volume.grid);
    Ok((
        scan.volume.as_slice().to_vec(),
        mask.as_slice().to_vec(),
        notes,
    ))
}

fn marked(i: usize) -> f32 {
    f32::from(u8::from(i % 7 == 2))
}

#[test]
fn a_mask_without_orientation_follows_the_scans_own_order() {
    let pages: Vec<Page> = (0..3)
        .map(|k| Page::grey(5, 4, (0..20).map(|i| marked(20 * k + i) as u64).collect()))
        .collect();
    for turn in turns() {
        let dir = tempfile::tempdir().unwrap();
        let scan = scan_of(dir.path(), &turn);
        let mask = dir.path().join("m.tif");
        std::fs::write(&mask, tiff(&pages, Order::default())).unwrap();
        let (values, found, notes) = lay(&scan, &mask).unwrap();
        for (value, found) in values.iter().zip(&found) {
            assert_eq!(*found, marked(*value as usize), "{turn:?}");
        }
        assert_eq!(notes.is_empty(), turn.is_identity(), "{notes:?}");
    }
}

#[test]
fn a_mask_with_an_orientation_lies_where_it_says() {
    for turn in turns() {
        let dir = tempfile::tempdir().unwrap();
        let scan = scan_of(dir.path(), &turn);
        // The same voxels, stored in another order of axes.
        let other = Turn {
            from: [1, 2, 0],
            reversed: [true, false, true],
        };
        let mask = turned(placed(&turn, marked), &other);
        let path = dir.path().join("m.nii.gz");
        nifti::write(&path, &mask).unwrap();
        let (values, found, notes) = lay(&scan, &path).unwrap();
        for (value, found) in values.iter().zip(&found) {
            assert_eq!(*found, marked(*value as usize), "{turn:?}");
        }
        assert!(notes.is_empty(), "{notes:?}");
    }
}

#[test]
fn a_scan_without_orientation_takes_the_masks_stored_order() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("s.tif");
    let page = |k: u64| Page::grey(5, 4, (0..20).map(|i| 20 * k + i).collect());
    std::fs::write(&scan, tiff(&[page(0), page(1), page(2)], Order::default())).unwrap();
    let turn = Turn {
        from: [0, 1, 2],
        reversed: [true, true, false],
    };
    let mask = dir.path().join("m.nii");
    nifti::write(&mask, &placed(&turn, marked)).unwrap();
    let scan = scan::read(&scan, Some(H)).unwrap();
    let mut notes = Vec::new();
    let found = laid::on(&scan, &mask, &mut notes).unwrap();
    assert!((0..60).all(|i| found.as_slice()[i] == marked(i)));
    assert!(
        notes[0].contains("the scan has no orientation"),
        "{notes:?}"
    );
}

#[test]
fn a_mask_of_another_size_or_place_is_refused() {
    let turn = Turn {
        from: [0, 1, 2],
        reversed: [true, true, false],
    };
    let dir = tempfile::tempdir().unwrap();
    let scan = scan_of(dir.path(), &turn);
    let refused = |mask: Volume<f32>| {
        let path = dir.path().join("m.nii");
        nifti::write(&path, &mask).unwrap();
        lay(&scan, &path).map(|_| ()).unwrap_err()
    };
    let mut moved = placed(&turn, marked);
    moved.affine = Some(affine(&turn, [1.01, -2.0, 3.0]));
    assert!(refused(moved).contains("up to 0.010 mm off"));
    let mut mirrored = placed(&turn, marked);
    mirrored.affine = Some(affine(
        &Turn {
            reversed: [false; 3],
            ..turn
        },
        [1.0, -2.0, 3.0],
    ));
    assert!(refused(mirrored).contains("mm off"));
    let mut larger = placed(&turn, marked);
    larger.grid.spacing_mm = H.map(|h| 2.0 * h);
    larger.affine = larger
        .affine
        .map(|a| a.map(|[x, y, z, o]| [2.0 * x, 2.0 * y, 2.0 * z, o]));
    assert!(
        refused(larger)
            .contains("its voxels are 0.04 × 0.06 × 0.1 mm, the scan's 0.02 × 0.03 × 0.05 mm")
    );
    let small = placed(&turn, marked).cropped(&[[0, 5], [0, 4], [0, 2]]);
    assert!(refused(small).contains("has 5 × 4 × 2 voxels, the scan has 5 × 4 × 3"));
    // A hundredth of a voxel is rounding.
    let mut near = placed(&turn, marked);
    near.affine = Some(affine(&turn, [1.0002, -2.0, 3.0]));
    let path = dir.path().join("m.nii");
    nifti::write(&path, &near).unwrap();
    assert!(lay(&scan, &path).is_ok());
}

/// A voxel size that is asked for scales the scan; its mask, which has the file's, still fits.
#[test]
fn a_mask_fits_a_scan_whose_voxel_size_was_overruled() {
    let turn = Turn {
        from: [2, 0, 1],
        reversed: [true, false, true],
    };
    let dir = tempfile::tempdir().unwrap();
    let path = scan_of(dir.path(), &turn);
    let mask = dir.path().join("m.nii");
    nifti::write(&mask, &placed(&turn, marked)).unwrap();
    let scan = scan::read(&path, Some([0.1; 3])).unwrap();
    let found = laid::on(&scan, &mask, &mut Vec::new()).unwrap();
    assert_eq!(found.grid.spacing_mm, [0.1; 3]);
    for (value, found) in scan.volume.as_slice().iter().zip(found.as_slice()) {
        assert_eq!(*found, marked(*value as usize));
    }
}

/// Directions without a voxel size say no place: they turn the mask, and corners are not compared.
#[test]
fn a_mask_with_directions_and_no_voxel_size_is_turned_and_not_placed() {
    use crate::written::text::Header;
    let turn = Turn {
        from: [2, 0, 1],
        reversed: [true, false, true],
    };
    let dir = tempfile::tempdir().unwrap();
    let path = scan_of(dir.path(), &turn);
    // The mask's axes are those of the scan: columns of the affine without their length, from RAS to LPS.
    let rows = affine(&turn, [0.0; 3]);
    let axis = |a: usize| [-rows[0][a], -rows[1][a], rows[2][a]].map(|v| v / H[a]);
    let matrix: Vec<String> = (0..3).flat_map(axis).map(|v| v.to_string()).collect();
    let mut header = Header::new(&[
        ("NDims", "3"),
        ("DimSize", "5 4 3"),
        ("ElementType", "MET_UCHAR"),
        ("Offset", "70 80 90"),
        ("TransformMatrix", &matrix.join(" ")),
        ("ElementDataFile", "LOCAL"),
    ]);
    let voxels: Vec<u8> = (0..60).map(|i| marked(i) as u8).collect();
    let mask = dir.path().join("m.mha");
    std::fs::write(&mask, [header.metaimage(), voxels.clone()].concat()).unwrap();
    let (values, found, notes) = lay(&path, &mask).unwrap();
    for (value, found) in values.iter().zip(&found) {
        assert_eq!(*found, marked(*value as usize));
    }
    assert!(notes[0].contains("has no voxel size"), "{notes:?}");
    header.set("ElementSpacing", "0.02 0.03 0.05");
    std::fs::write(&mask, [header.metaimage(), voxels].concat()).unwrap();
    let words = lay(&path, &mask).map(|_| ()).unwrap_err();
    assert!(words.contains("mm off the scan's"), "{words}");
}

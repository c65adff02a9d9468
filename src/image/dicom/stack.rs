//! Owns the order and the distance of slices: by their places along the normal, by SliceLocation, or by their numbers.

use super::ADVICE;
use super::frames::{Frame, dot, normal};
use super::head::Image;
use crate::error::{Error, Result};
use crate::format::orient;

/// Sorts the slices of a series and gives their distance in mm, where it is known.
///
/// # Errors
/// Slices without an order; two at one place; distances that differ by more than their digits explain; slices that lie
/// off the normal (a tilted gantry).
pub fn sort(
    frames: &mut [Frame],
    images: &[Image],
    notes: &mut Vec<String>,
) -> Result<Option<f64>> {
    let path = |f: &Frame| &images[f.file].path;
    if frames.len() < 2 {
        return Ok(frames.first().and_then(|f| f.distance_mm));
    }
    if let (true, Some(directions)) = (
        frames.iter().all(|f| f.position_mm.is_some()),
        frames[0].directions,
    ) {
        let normal = normal(&directions);
        let along = |f: &Frame| f.position_mm.map_or(0.0, |p| dot(p, normal));
        frames.sort_by(|a, b| along(a).total_cmp(&along(b)));
        straight(frames, normal, images)?;
        let digit = frames.iter().map(|f| f.digit_mm).fold(1.0, f64::min);
        let reach = normal.map(f64::abs).iter().sum::<f64>();
        let places: Vec<f64> = frames.iter().map(along).collect();
        return even(&places, digit * reach, frames, images, notes).map(Some);
    }
    let mut places: Vec<f64> = frames.iter().filter_map(|f| f.location_mm).collect();
    places.sort_by(f64::total_cmp);
    if places.len() == frames.len() && places.windows(2).all(|p| p[0] < p[1]) {
        notes.push("slices carry no position: sorted by SliceLocation".into());
        frames.sort_by(|a, b| {
            let place = |f: &Frame| f.location_mm.unwrap_or(0.0);
            place(a).total_cmp(&place(b))
        });
        return even(&places, 0.0, frames, images, notes).map(Some);
    }
    let number = |f: &Frame| (f.instance.unwrap_or(0.0), f.index);
    frames.sort_by(|a, b| {
        let ((x, i), (y, j)) = (number(a), number(b));
        x.total_cmp(&y).then(i.cmp(&j))
    });
    for pair in frames.windows(2) {
        let numbered = pair[0].file == pair[1].file || pair[1].instance.is_some();
        if number(&pair[0]) == number(&pair[1]) || !numbered {
            return Err(Error::file(
                path(&pair[1]),
                "has no position, no SliceLocation and no InstanceNumber of its own: the order of the slices is not known",
                "export the series again with positions, or convert it to a format that holds the whole volume (dcm2niix)",
            ));
        }
    }
    let distance = frames[0].distance_mm;
    notes.push(match distance {
        Some(_) => "slices carry no position: sorted by their number (InstanceNumber, or order in the file), their distance taken from the spacing or thickness that the header gives",
        None => "slices carry no position: sorted by their number (InstanceNumber, or order in the file)",
    }.into());
    Ok(distance)
}

/// Refuses slices that drift sideways: on average, or one alone.
fn straight(frames: &[Frame], normal: [f64; 3], images: &[Image]) -> Result<()> {
    let Some(first) = frames[0].position_mm else {
        return Ok(());
    };
    let digit = frames.iter().map(|f| f.digit_mm).fold(1.0, f64::min);
    for f in frames {
        let from = f.position_mm.unwrap_or(first);
        let away: [f64; 3] = std::array::from_fn(|r| from[r] - first[r]);
        let along = dot(away, normal);
        let sideways = (dot(away, away) - along * along).max(0.0).sqrt();
        let angle_deg = sideways.atan2(along).to_degrees();
        // Positions of slices a tenth of a degree off would drift less than their digits or a voxel in 500.
        if sideways > 2.0 * digit && angle_deg > orient::SMALLEST_ANGLE_DEG {
            return Err(orient::sheared(&images[f.file].path, angle_deg));
        }
    }
    Ok(())
}

/// The distance of slices at `places`, which have to lie evenly. `digit_mm` is what rounding may have moved one by; a missing
/// or doubled slice moves its neighbours by half a distance or more.
fn even(
    places: &[f64],
    digit_mm: f64,
    frames: &[Frame],
    images: &[Image],
    notes: &mut Vec<String>,
) -> Result<f64> {
    let count = places.len() - 1;
    let mean = (places[count] - places[0]) / count as f64;
    let off = |step: f64| {
        let away = |k: usize| (places[k] - places[0] - k as f64 * step).abs();
        (0..=count).map(away).fold(0.0, f64::max)
    };
    let uneven = |k: usize| (places[k] - places[k - 1] - mean).abs();
    let Some(worst) = (1..=count).max_by(|a, b| uneven(*a).total_cmp(&uneven(*b))) else {
        return Ok(mean);
    };
    // Unrounded positions are good to about 1e-4 mm.
    if uneven(worst) <= 0.05 * mean + 2e-4 && mean > 0.0 {
        return Ok((mean * 1e7).round() / 1e7);
    }
    if mean > 0.0 && off(mean) <= (0.3 * mean).min(digit_mm) {
        let stated = frames[0]
            .distance_mm
            .filter(|stated| off(*stated) <= digit_mm);
        let distance = stated.unwrap_or((mean * 1e5).round() / 1e5);
        notes.push(format!(
            "positions of slices are rounded to {digit_mm} mm: taken as evenly {distance} mm apart"
        ));
        return Ok(distance);
    }
    let gap = places[worst] - places[worst - 1];
    Err(Error::file(
        &images[frames[worst].file].path,
        format!(
            "lies {gap:.4} mm after the slice before it, where slices are {mean:.4} mm apart on average"
        ),
        match gap < 1e-6 {
            true => {
                "two slices lie at one place: keep one time, echo or reconstruction in the folder"
            }
            false => "a slice is missing or doubled: export the whole series",
        },
    ))
}

/// Whether `other` belongs to the same stack as `first`.
pub fn same(first: &Frame, other: &Frame, images: &[Image]) -> Result<()> {
    let (a, b) = (&images[first.file], &images[other.file]);
    let differs = |what: String, advice: &str| Err(Error::file(&b.path, what, advice));
    if (b.rows, b.columns) != (a.rows, a.columns) {
        return differs(
            format!(
                "slice of {} × {} pixels in a series whose first slice has {} × {}",
                b.columns, b.rows, a.columns, a.rows
            ),
            "keep one series in a folder, without localisers",
        );
    }
    if b.series != a.series {
        return differs(
            "belongs to another series than the first slice".into(),
            "keep one series in a folder: sort the files by SeriesInstanceUID",
        );
    }
    if !same_pixel(first, other) {
        return differs(
            format!(
                "slice with pixels of {} mm in a series whose first slice has {}",
                words(other.pixel_mm),
                words(first.pixel_mm)
            ),
            "keep slices of one reconstruction in a folder",
        );
    }
    let angle = match (first.directions, other.directions) {
        (Some(x), Some(y)) => (0..6).map(|i| (x[i] - y[i]).abs()).fold(0.0, f64::max),
        (None, None) => 0.0,
        _ => 1.0,
    };
    if angle > 2e-3
        || first.position_mm.is_some() != other.position_mm.is_some() && first.file != other.file
    {
        return differs(
            "slice of another orientation than the first, or one without its place".into(),
            "keep one series in a folder, without localisers",
        );
    }
    if first.scale.unit != other.scale.unit {
        return differs(
            format!(
                "slice in {}, in a series whose first slice is in {}",
                other.scale.unit.as_deref().unwrap_or("no unit"),
                first.scale.unit.as_deref().unwrap_or("no unit")
            ),
            ADVICE,
        );
    }
    Ok(())
}

fn same_pixel(first: &Frame, other: &Frame) -> bool {
    match (first.pixel_mm, other.pixel_mm) {
        (Some(a), Some(b)) => (0..2).all(|i| (b[i] / a[i] - 1.0).abs() < 1e-3),
        (a, b) => a == b,
    }
}

fn words(pixel_mm: Option<[f64; 2]>) -> String {
    pixel_mm.map_or("unknown".into(), |[row, column]| {
        format!("{column} × {row}")
    })
}

//! Owns the wording of numbers and lists in a methods section.

/// Names that are listed; of more their number is given.
const MOST_NAMES: usize = 4;

/// Values that are listed; of more the range is given.
const MOST_VALUES: usize = 3;

/// A setting, without the digits that single precision adds.
pub fn setting(v: f64) -> String {
    let digits = match v == 0.0 {
        true => 0,
        false => 6 - (v.abs().log10().floor() as i32 + 1),
    };
    let scale = 10f64.powi(digits);
    match scale.is_finite() && scale > 0.0 {
        true => ((v * scale).round() / scale).to_string(),
        false => v.to_string(),
    }
}

/// A size of elements or lattices in mm, without the digits of a voxel that was divided by a whole number.
pub fn size(mm: f64) -> f64 {
    (mm * 1e5).round() / 1e5
}

/// A result, to three digits.
pub fn result(v: f64) -> String {
    let magnitude = match v == 0.0 {
        true => 0,
        // Of the rounded value: 9.996 is 10.0.
        false => (v.abs() * (1.0 + 5e-4)).log10().floor() as i32,
    };
    format!("{:.*}", (2 - magnitude).clamp(0, 9) as usize, v)
}

pub fn percent(share: f64) -> String {
    format!("{} %", result(100.0 * share))
}

/// "a", "a and b", "a, b and c".
pub fn list<T: AsRef<str>>(words: &[T]) -> String {
    match words {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

/// Names of scans, or how many there are.
pub fn scans(names: &[&str]) -> String {
    match names.len() > MOST_NAMES {
        true => format!("{} scans", names.len()),
        false => list(names),
    }
}

/// Different settings of one kind: all of a few, the range of many.
pub fn settings(values: impl IntoIterator<Item = f64>) -> String {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let mut all: Vec<String> = sorted.into_iter().map(setting).collect();
    all.dedup();
    match &all[..] {
        [first, .., last] if all.len() > MOST_VALUES => format!("{first} to {last}"),
        few => list(few),
    }
}

/// Mean and range of results in a unit; None without any.
pub fn mean_and_range(values: &[f64], unit: &str) -> Option<String> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match n {
        0 => None,
        1 => Some(format!("{} {unit}", result(mean))),
        _ => Some(format!(
            "{} {unit} in the mean ({} to {} {unit})",
            result(mean),
            result(low),
            result(high)
        )),
    }
}

/// A sentence for each of the different things that `says` has of `items`; with their scans where they differ.
pub fn by_scan<T>(
    items: &[T],
    scan: impl Fn(&T) -> &str,
    says: impl Fn(&T) -> Option<String>,
) -> String {
    let mut found: Vec<(Option<String>, Vec<&str>)> = Vec::new();
    for item in items {
        let words = says(item);
        match found.iter_mut().find(|(known, _)| *known == words) {
            Some((_, scans)) => scans.push(scan(item)),
            None => found.push((words, vec![scan(item)])),
        }
    }
    let alike = found.len() == 1;
    let sentences = found.into_iter().filter_map(|(words, names)| {
        let words = words?;
        Some(match alike {
            true => format!(" {words}."),
            false => format!(" {words} (of {}).", scans(&names)),
        })
    });
    sentences.collect()
}

/// "1 scan", "2 scans".
pub fn counted(n: usize, one: &str) -> String {
    match n {
        1 => format!("1 {one}"),
        _ => format!("{n} {one}s"),
    }
}

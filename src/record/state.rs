//! Owns a scene's kept state as a file: a line of format, the scene's fingerprint, arrays by name (64-bit floats, little
//! endian), and the BLAKE3 of all that.

use crate::error::Result;
use crate::io::atomic;
use crate::scene::state::State;
use std::path::Path;

const FORMAT: &str = "bonepd-ct scene state 1\n";
const HASH: usize = 32;

/// What a file holds for a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum StateFile {
    Nothing,
    /// Why it cannot be used.
    Unusable(&'static str),
    State(State),
}

/// Writes `state`, whole or not at all. `fingerprint` says of which scene.
pub fn write(path: &Path, fingerprint: &str, state: &State) -> Result<()> {
    let mut bytes = format!("{FORMAT}{fingerprint}\n").into_bytes();
    for (name, values) in state.arrays() {
        bytes.extend((name.len() as u64).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend((values.len() as u64).to_le_bytes());
        values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    let hash = blake3::hash(&bytes);
    bytes.extend(hash.as_bytes());
    atomic::write(path, bytes)
}

/// Reads what [`write()`] left for the scene of this fingerprint.
pub fn read(path: &Path, fingerprint: &str) -> StateFile {
    let Ok(bytes) = std::fs::read(path) else {
        return StateFile::Nothing;
    };
    let (body, hash) = bytes.split_at(bytes.len().saturating_sub(HASH));
    if blake3::hash(body).as_bytes() != hash {
        return StateFile::Unusable("it is damaged");
    }
    let Some(body) = body.strip_prefix(FORMAT.as_bytes()) else {
        return StateFile::Unusable("it is of another version");
    };
    match body.strip_prefix(format!("{fingerprint}\n").as_bytes()) {
        Some(body) => arrays(body).map_or(StateFile::Unusable("it is damaged"), StateFile::State),
        None => StateFile::Unusable("it is of another scene"),
    }
}

fn arrays(mut bytes: &[u8]) -> Option<State> {
    let mut state = State::default();
    while !bytes.is_empty() {
        let length = count(&mut bytes)?;
        let name = std::str::from_utf8(bytes.split_off(..length)?).ok()?;
        let length = count(&mut bytes)?.checked_mul(8)?;
        let (values, _) = bytes.split_off(..length)?.as_chunks::<8>();
        let values: Vec<f64> = values.iter().map(|v| f64::from_le_bytes(*v)).collect();
        state.put(name, values);
    }
    Some(state)
}

fn count(bytes: &mut &[u8]) -> Option<usize> {
    let (first, _) = bytes.split_off(..8)?.as_chunks::<8>();
    usize::try_from(u64::from_le_bytes(*first.first()?)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_read_back_and_others_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state.bin");
        assert_eq!(read(&path, "a"), StateFile::Nothing);
        let mut state = State::default();
        state.put("q", [0.1, -f64::MIN_POSITIVE, 1e300]);
        state.put("none", []);
        write(&path, "a", &state).unwrap();
        assert_eq!(read(&path, "a"), StateFile::State(state));
        assert!(
            matches!(read(&path, "b"), StateFile::Unusable(why) if why.contains("another scene"))
        );
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[70] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        assert!(matches!(read(&path, "a"), StateFile::Unusable(why) if why.contains("damaged")));
        std::fs::write(&path, &bytes[..9]).unwrap();
        assert!(matches!(read(&path, "a"), StateFile::Unusable(_)));
    }
}

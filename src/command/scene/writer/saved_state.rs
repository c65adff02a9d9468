//! Owns the state that a stopped scene resumes from, next to its results.

use super::Writer;
use crate::error::{Error, Result};
use crate::export::points as files;
use crate::record::history;
use crate::record::state;
use crate::record::state::StateFile;
use crate::scene::state::State;
use std::path::PathBuf;
use std::time::Instant;

const STATE: &str = "state.bin";

const ROWS: &str = "writer.rows";
const TIMES: &str = "writer.times";
const MAP: &str = "writer.map.";

impl Writer<'_> {
    fn state_path(&self) -> PathBuf {
        self.out.join(STATE)
    }

    /// Whether this very scene was stopped here before.
    pub fn goes_on(&self) -> bool {
        let kept = || state::read(&self.state_path(), &self.fingerprint);
        !self.session.force && matches!(kept(), StateFile::State(_))
    }

    /// A finished scene has nothing to go on from.
    pub fn forget(&self) -> Result<()> {
        let path = self.state_path();
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::file(
                path,
                format!("cannot be removed: {e}"),
                "remove it by hand: it belongs to a finished scene",
            )),
            _ => Ok(()),
        }
    }

    /// What had been reported up to a kept state: rows of the history, and maps, from their files.
    fn recall(&mut self, state: &State) -> Result<()> {
        let rows = state.number(ROWS)? as usize;
        self.history = history::read(&self.out.join("history.csv"), rows)?;
        let times = state.find(TIMES).unwrap_or_default();
        let names = state.arrays().filter_map(|(n, _)| n.strip_prefix(MAP));
        // Numbered, so that they come back in their order.
        let names: Vec<&str> = names.filter_map(|n| Some(n.split_once('.')?.1)).collect();
        for &t in times {
            let file = self.out.join(format!("fields_t{t}.csv"));
            let scalar = |name: &&str| {
                let values = files::read_column(&file, name)?;
                Ok((
                    (*name).to_owned(),
                    values.into_iter().map(|v| v.1).collect(),
                ))
            };
            let scalars = names.iter().map(scalar).collect::<Result<_>>()?;
            self.maps.push((t, scalars));
        }
        self.bar.set_position(rows as u64);
        Ok(())
    }

    /// Where this scene was stopped before, with what had been written by then.
    pub(super) fn last_state(&mut self) -> Result<Option<State>> {
        if self.session.force {
            return Ok(None);
        }
        let state = match state::read(&self.state_path(), &self.fingerprint) {
            StateFile::Nothing => return Ok(None),
            StateFile::Unusable(why) => {
                self.session.say(format!(
                    "{STATE} is not used: {why}; starting from the beginning"
                ));
                return Ok(None);
            }
            StateFile::State(state) => state,
        };
        if let Err(e) = self.recall(&state) {
            self.session.say(format!(
                "{STATE} is not used: {e}\nstarting from the beginning"
            ));
            self.history.clear();
            self.maps.clear();
            return Ok(None);
        }
        Ok(Some(state))
    }

    /// Keeps the state, where the last one is old enough.
    pub(super) fn keep_state(&mut self, state: &dyn Fn() -> State) -> Result<()> {
        if self.kept.elapsed() < self.every {
            return Ok(());
        }
        self.write_history()?;
        let mut state = state();
        state.put(ROWS, [self.history.len() as f64]);
        let times: Vec<f64> = self.maps.iter().map(|(t, _)| *t).collect();
        state.put(TIMES, times);
        let names = self.maps.first().map(|(_, s)| s.as_slice());
        for (k, (name, _)) in names.unwrap_or_default().iter().enumerate() {
            state.put(&format!("{MAP}{k:04}.{name}"), []);
        }
        state::write(&self.state_path(), &self.fingerprint, &state)?;
        self.kept = Instant::now();
        Ok(())
    }
}

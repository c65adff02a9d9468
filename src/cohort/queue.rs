//! Owns the order of jobs: so many at a time, and not more than memory allows.

use std::sync::{Condvar, Mutex};

struct State {
    next: usize,
    running: usize,
    taken_mib: f64,
}

/// Runs `job(i)` for every `i` of `memory_mib`, in order, `jobs` at a time; one starts only while the estimates of all
/// running stay within `limit_mib`, or when nothing else runs.
pub fn run(memory_mib: &[f64], jobs: usize, limit_mib: f64, job: impl Fn(usize) + Sync) {
    let state = Mutex::new(State {
        next: 0,
        running: 0,
        taken_mib: 0.0,
    });
    let changed = Condvar::new();
    let worker = || {
        while let Some(i) = next(&state, &changed, memory_mib, limit_mib) {
            job(i);
            let mut state = state.lock().expect("jobs do not panic with the lock");
            state.running -= 1;
            state.taken_mib -= memory_mib[i];
            changed.notify_all();
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, memory_mib.len().max(1)) {
            scope.spawn(worker);
        }
    });
}

/// Takes the next job, once there is room for it. None when all are taken.
fn next(
    state: &Mutex<State>,
    changed: &Condvar,
    memory_mib: &[f64],
    limit_mib: f64,
) -> Option<usize> {
    let mut state = state.lock().expect("jobs do not panic with the lock");
    loop {
        let need = *memory_mib.get(state.next)?;
        if state.running == 0 || state.taken_mib + need <= limit_mib {
            let i = state.next;
            state.next += 1;
            state.running += 1;
            state.taken_mib += need;
            return Some(i);
        }
        state = changed
            .wait(state)
            .expect("jobs do not panic with the lock");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Runs jobs that last a moment; returns how often each ran and the most memory taken at once.
    fn observe(memory_mib: &[f64], jobs: usize, limit_mib: f64) -> (Vec<usize>, f64) {
        let seen = Mutex::new((vec![0; memory_mib.len()], 0.0, 0.0f64));
        run(memory_mib, jobs, limit_mib, |i| {
            let mut s = seen.lock().unwrap();
            s.0[i] += 1;
            s.1 += memory_mib[i];
            s.2 = s.2.max(s.1);
            drop(s);
            std::thread::sleep(Duration::from_millis(3));
            seen.lock().unwrap().1 -= memory_mib[i];
        });
        let (ran, _, most) = seen.into_inner().unwrap();
        (ran, most)
    }

    #[test]
    fn every_job_runs_once_within_the_memory() {
        let (ran, most) = observe(&[3.0, 4.0, 2.0, 5.0, 1.0, 4.0], 4, 7.0);
        assert_eq!(ran, [1; 6]);
        assert!(most <= 7.0, "{most}");
        assert!(most > 5.0, "jobs ran one at a time: {most}");
    }

    #[test]
    fn a_job_larger_than_the_memory_runs_alone() {
        let (ran, most) = observe(&[1.0, 9.0, 1.0], 3, 2.0);
        assert_eq!(ran, [1; 3]);
        assert_eq!(most, 9.0);
    }

    #[test]
    fn no_jobs_are_no_work() {
        assert_eq!(observe(&[], 2, 1.0).0, Vec::<usize>::new());
    }
}

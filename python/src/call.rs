//! Owns long calls: they compute in a thread of their own while this one looks for Ctrl-C, and failures become exceptions.

use bonepd_ct::error::{Error, Result};
use bonepd_ct::machine::interrupt::Stop;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

/// How often this thread looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// How long a computation that was asked to stop is waited for. One that builds a large model may take longer: it ends in the background.
const PATIENCE: Duration = Duration::from_secs(5);

/// As much as the system gives a program's first thread.
const STACK_BYTES: usize = 8 << 20;

/// What ended a computation without a result.
type Panic = Box<dyn std::any::Any + Send>;

/// The result of `work`, computed on `threads` threads (None: as many as there are cores) without the interpreter's lock.
///
/// # Errors
/// Those of `work` as exceptions; `KeyboardInterrupt` and whatever else a signal raises: then `stop` is asked.
pub fn computed<T: Send + 'static>(
    py: Python<'_>,
    stop: &Stop,
    threads: Option<i64>,
    work: impl FnOnce() -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let (done, mut answers) = channel();
    let worker = move || {
        let result = catch_unwind(AssertUnwindSafe(|| on_threads(threads, work)));
        // Nobody waits any more for what was stopped.
        let _ = done.send(result);
    };
    Builder::new()
        .name("bonepd-ct".to_owned())
        .stack_size(STACK_BYTES)
        .spawn(worker)?;
    loop {
        let answer;
        (answers, answer) = waited(py, answers, LOOK);
        match answer {
            Ok(Ok(result)) => return result.map_err(|error| raised(py, &error)),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => return Err(bug()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(signal) = py.check_signals() {
            stop.ask();
            let _ = waited(py, answers, PATIENCE);
            return Err(signal);
        }
    }
}

type Answers<T> = Receiver<std::result::Result<Result<T>, Panic>>;
type Answer<T> = std::result::Result<std::result::Result<Result<T>, Panic>, RecvTimeoutError>;

fn waited<T: Send>(py: Python<'_>, answers: Answers<T>, time: Duration) -> (Answers<T>, Answer<T>) {
    py.detach(move || {
        let answer = answers.recv_timeout(time);
        (answers, answer)
    })
}

fn on_threads<T: Send>(threads: Option<i64>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    let Some(asked) = threads else {
        return work();
    };
    let threads = usize::from(u16::try_from(asked).unwrap_or(0));
    if threads == 0 {
        let found = format!("expected 1 to {}, found {asked}", u16::MAX);
        return Err(Error::setting("threads", found, "leave it out: one a core"));
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK_BYTES)
        .build()
        .map_err(|e| Error::setting("threads", e.to_string(), "ask for fewer"))?;
    pool.install(work)
}

fn bug() -> PyErr {
    PyRuntimeError::new_err("the program failed (a bug): report it with the settings of the call")
}

/// The exception of an error, with the same words.
pub fn raised(py: Python<'_>, error: &Error) -> PyErr {
    let name = match error {
        Error::File { .. } => "FileError",
        Error::Setting { .. } => "SettingError",
        Error::Specimen { .. } => "SpecimenError",
        _ => "BonepdError",
    };
    let made = || {
        let class = py.import("bonepd_ct._errors")?.getattr(name)?;
        class.call1((error.to_string(),))
    };
    made().map_or_else(|failed| failed, PyErr::from_value)
}

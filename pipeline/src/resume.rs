//! Running a step: skipped where its record still holds, whole or not at all.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    time::Instant,
};

use serde_json::{Value, json};
use toile_capture::files::{atomic_write, atomic_write_all};

use crate::{
    Observer, PipelineError, hash, json, memory,
    record::{self, Record},
    step::{Product, Step},
};

/// How long each step of a folder took.
pub(crate) const TIMINGS: &str = "timings.json";
/// Part of every record's hash: a new program version builds again.
pub(crate) const PROGRAM: &str = concat!("toile ", env!("CARGO_PKG_VERSION"));

/// The record of an earlier run with the same hash whose outputs are still what it wrote; else the work is done, its
/// files and the record are written, and that is given. Paths in the record are relative to `root`.
///
/// # Errors
/// The error of the work, or a file that cannot be read or written.
pub fn run_step<S: Step>(step: &S, root: &Path, observer: &dyn Observer) -> Result<Record<S::Report>, PipelineError> {
    let (label, started) = (step.label(), Instant::now());
    let inputs = hashes(root, &step.inputs()?)?;
    let (settings, folder) = (step.settings()?, step.folder());
    let hash = hash_of::<S>(&inputs, &settings);
    match record::read::<S::Report>(&folder, S::NAME) {
        Ok(Some(record)) if record.hash == hash && is_intact(step, root, &record) => {
            tracing::info!("{label}: up to date");
            observer.skip(step.seconds());
            return Ok(record);
        }
        Ok(_) => {}
        Err(error) => observer.remark(&format!("{error}; {label} runs again")),
    }
    observer.begin(&label, step.seconds());
    let Product { files, report, remarks, mut timings } = step.work(&|fraction| observer.at(fraction))?;
    if S::OUTPUTS_VARY {
        let written = files.iter().map(|(path, bytes)| (relative(root, path), hash::bytes(bytes)));
        timings = json!({ "outputs": written.collect::<BTreeMap<_, _>>() });
    }
    let hash_of_output = |bytes: &[u8]| if S::OUTPUTS_VARY { String::new() } else { hash::bytes(bytes) };
    let record = Record {
        version: S::VERSION,
        hash,
        inputs,
        settings,
        outputs: files.iter().map(|(path, bytes)| (relative(root, path), hash_of_output(bytes))).collect(),
        result: report,
        warnings: remarks.warnings,
        lost: remarks.lost,
        failures: remarks.failures,
    };
    atomic_write_all(&files)?;
    write_timings(&folder, S::NAME, timings, started)?;
    record::write(&folder, PROGRAM, S::NAME, &record)?;
    observer.end();
    tracing::info!("{label}: {:.1} s", started.elapsed().as_secs_f64());
    Ok(record)
}

fn hash_of<S: Step>(inputs: &BTreeMap<String, String>, settings: &Value) -> String {
    hash::bytes(json!([PROGRAM, S::NAME, S::VERSION, inputs, settings]).to_string().as_bytes())
}

fn hashes(root: &Path, paths: &[PathBuf]) -> Result<BTreeMap<String, String>, PipelineError> {
    paths.iter().map(|path| Ok((relative(root, path), hash::file(path)?))).collect()
}

fn relative(root: &Path, path: &Path) -> String {
    match path.strip_prefix(root) {
        Ok(inside) => inside.to_string_lossy().into_owned(),
        // Only the name: where a file lay must not change what is written.
        Err(_) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
    }
}

fn is_intact<S: Step>(step: &S, root: &Path, record: &Record<S::Report>) -> bool {
    let outputs = step.outputs();
    let written = if S::OUTPUTS_VARY { varied(&step.folder(), S::NAME) } else { Some(record.outputs.clone()) };
    written.is_some_and(|written| hashes(root, &outputs).is_ok_and(|now| now == written))
}

/// What a step whose outputs contain times wrote: its hashes stand beside its own times, since `report.json` is the same
/// from run to run.
fn varied(folder: &Path, step: &str) -> Option<BTreeMap<String, String>> {
    serde_json::from_value(read_timings(folder).get(step)?.get("outputs")?.clone()).ok()
}

/// Times that cannot be read are of no use to anybody: they start anew.
pub(crate) fn read_timings(folder: &Path) -> BTreeMap<String, Value> {
    json::read(&folder.join(TIMINGS)).unwrap_or_default()
}

fn write_timings(folder: &Path, step: &str, detail: Value, started: Instant) -> Result<(), PipelineError> {
    let mut all = read_timings(folder);
    let mut mine = json!({
        "seconds": (started.elapsed().as_secs_f64() * 1e3).round() / 1e3,
        "peak_memory_bytes": memory::peak_bytes(),
        "threads": rayon::current_num_threads(),
    });
    if let (Some(mine), Value::Object(detail)) = (mine.as_object_mut(), detail) {
        mine.extend(detail);
    }
    all.insert(step.into(), mine);
    Ok(atomic_write(&folder.join(TIMINGS), &json::pretty(&all)?)?)
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, fs};

    use serde::{Deserialize, Serialize};

    use super::*;
    use crate::observer::Silent;

    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    struct Counted {
        frames: u32,
    }

    /// Copies a file, and counts how often it did.
    struct Copy<const VARIES: bool = false> {
        dir: tempfile::TempDir,
        runs: Cell<u32>,
        setting: Cell<u32>,
    }

    impl<const VARIES: bool> Copy<VARIES> {
        fn new() -> Self {
            let dir = tempfile::tempdir().unwrap();
            fs::write(dir.path().join("in"), b"take").unwrap();
            Self { dir, runs: Cell::new(0), setting: Cell::new(1) }
        }

        fn at(&self, name: &str) -> PathBuf {
            self.dir.path().join(name)
        }

        /// How often the work was done after one more run.
        fn run(&self) -> u32 {
            assert_eq!(run_step(self, self.dir.path(), &Silent).unwrap().result, Counted { frames: 4 });
            self.runs.get()
        }
    }

    impl<const VARIES: bool> Step for Copy<VARIES> {
        type Report = Counted;
        const NAME: &'static str = "copy";
        const VERSION: u32 = 1;
        const SECONDS: f64 = 1.0;
        const OUTPUTS_VARY: bool = VARIES;

        fn label(&self) -> String {
            "a copy".into()
        }

        fn folder(&self) -> PathBuf {
            self.at("build")
        }

        fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
            Ok(vec![self.at("in")])
        }

        fn settings(&self) -> Result<Value, PipelineError> {
            Ok(json!({ "voxel": self.setting.get() }))
        }

        fn outputs(&self) -> Vec<PathBuf> {
            vec![self.at("build/out")]
        }

        fn work(&self, _: &(dyn Fn(f32) + Sync)) -> Result<Product<Counted>, PipelineError> {
            self.runs.set(self.runs.get() + 1);
            let bytes = fs::read(self.at("in")).unwrap();
            Ok(Product::new(vec![(self.at("build/out"), bytes)], Counted { frames: 4 }, Vec::new()))
        }
    }

    #[test]
    fn the_same_is_not_done_twice() {
        let copy: Copy = Copy::new();
        assert_eq!([copy.run(), copy.run()], [1, 1]);
        assert_eq!(fs::read(copy.at("build/out")).unwrap(), b"take");
    }

    #[test]
    fn other_input_settings_or_a_damaged_output_is_done_again() {
        let copy: Copy = Copy::new();
        copy.run();
        copy.setting.set(2);
        assert_eq!(copy.run(), 2);
        fs::write(copy.at("in"), b"retake").unwrap();
        assert_eq!(copy.run(), 3);
        fs::write(copy.at("build/out"), b"damaged").unwrap();
        assert_eq!([copy.run(), copy.run()], [4, 4]);
        assert_eq!(fs::read(copy.at("build/out")).unwrap(), b"retake");
    }

    #[test]
    fn an_output_that_varies_is_made_again_once_it_is_altered_emptied_or_gone() {
        let copy: Copy<true> = Copy::new();
        assert_eq!([copy.run(), copy.run()], [1, 1]);
        let record = fs::read_to_string(copy.at("build/report.json")).unwrap();
        for (runs, content) in (2..).zip(["altered", ""]) {
            fs::write(copy.at("build/out"), content).unwrap();
            assert_eq!([copy.run(), copy.run()], [runs; 2]);
        }
        fs::remove_file(copy.at("build/out")).unwrap();
        assert_eq!([copy.run(), copy.run()], [4, 4]);
        assert_eq!(fs::read(copy.at("build/out")).unwrap(), b"take");
        assert_eq!(
            fs::read_to_string(copy.at("build/report.json")).unwrap(),
            record,
            "it holds no hash of what varies"
        );
    }

    #[test]
    fn a_record_that_was_changed_is_named_and_its_step_runs_again() {
        let copy: Copy = Copy::new();
        copy.run();
        let path = copy.at("build/report.json");
        let whole = fs::read_to_string(&path).unwrap();
        let changes = [("\"frames\": 4", "\"frames\": 5"), ("\"frames\": 4", "\"count\": 4"), ("{", "[")];
        for (runs, (from, to)) in (2..).zip(changes) {
            fs::write(&path, whole.replacen(from, to, 1)).unwrap();
            let error = record::read::<Counted>(&copy.at("build"), "copy").unwrap_err();
            assert_eq!(error.file(), Some(path.as_path()), "{error}");
            assert_eq!([copy.run(), copy.run()], [runs; 2], "{to}");
            assert_eq!(fs::read_to_string(&path).unwrap(), whole);
        }
    }

    #[test]
    fn an_error_leaves_no_record() {
        let copy: Copy = Copy::new();
        fs::remove_file(copy.at("in")).unwrap();
        assert!(run_step(&copy, copy.dir.path(), &Silent).is_err());
        assert!(!copy.at("build").exists());
    }

    #[test]
    fn records_of_other_steps_in_the_folder_stay() {
        let copy: Copy = Copy::new();
        copy.run();
        let record = record::read::<Counted>(&copy.at("build"), "copy").unwrap().unwrap();
        record::write(&copy.at("build"), PROGRAM, "other", &record).unwrap();
        assert_eq!(copy.run(), 1);
        assert_eq!(record::read::<Counted>(&copy.at("build"), "other").unwrap(), Some(record));
    }
}

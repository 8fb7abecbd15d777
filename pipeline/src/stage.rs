//! A stage on files: skipped when its inputs, settings and version are what its record says, whole or not at all.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    time::Instant,
};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::{Observer, PipelineError, disk, hash, memory};

/// Part of every stage's hash: a new program version builds again.
const PROGRAM: &str = concat!("toile ", env!("CARGO_PKG_VERSION"));

/// What a stage reads, decides with and writes. Paths lie under `root`.
pub struct Stage<'a> {
    /// Name of the stage, a key of `report.json`.
    pub name: &'static str,
    /// Raised whenever the same inputs and settings give another result.
    pub version: u32,
    /// Expected seconds, for the time left.
    pub cost: f64,
    /// What the records' paths are relative to: the subject's folder.
    pub root: &'a Path,
    /// Folder of the stage's `report.json` and `timings.json`.
    pub folder: PathBuf,
    /// Files that decide the result.
    pub inputs: Vec<PathBuf>,
    /// The resolved settings.
    pub settings: Value,
    /// Files that the stage writes.
    pub outputs: Vec<PathBuf>,
    /// True where the outputs tell times and so differ from run to run: the record then has no hash of them.
    pub outputs_vary: bool,
}

/// What a stage made.
#[derive(Default)]
pub struct Product {
    /// The files, one for each of the stage's outputs.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// What was decided: residuals, counts, verdicts. The same for any number of threads.
    pub result: Value,
    /// What to worry about, a sentence each.
    pub warnings: Vec<String>,
    /// Recorded data that was lost, a sentence each.
    pub lost: Vec<String>,
    /// What failed although the run goes on, a sentence each.
    pub failures: Vec<String>,
    /// Milliseconds by step and the like.
    pub timings: Value,
}

/// What `report.json` says of a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of the stage.
    pub version: u32,
    /// Hash of program, stage version, inputs and settings.
    pub hash: String,
    /// SHA-256 of every input by its path.
    pub inputs: BTreeMap<String, String>,
    /// The resolved settings.
    pub settings: Value,
    /// SHA-256 of every output by its path.
    pub outputs: BTreeMap<String, String>,
    /// What was decided.
    pub result: Value,
    /// What to worry about.
    pub warnings: Vec<String>,
    /// Recorded data that was lost.
    pub lost: Vec<String>,
    /// What failed although the run went on.
    #[serde(default)]
    pub failures: Vec<String>,
}

/// All stages that worked in one folder.
#[derive(Default, Serialize, Deserialize)]
struct Report {
    program: String,
    stages: BTreeMap<String, Record>,
}

impl Stage<'_> {
    /// The record of an earlier run with the same hash whose outputs are still what it wrote; else runs `work`,
    /// writes its files and the record, and returns that.
    ///
    /// # Errors
    /// What `work` says, or a file that cannot be read or written.
    pub fn run(
        &self,
        label: &str,
        observer: &dyn Observer,
        work: impl FnOnce(&(dyn Fn(f32) + Sync)) -> Result<Product, PipelineError>,
    ) -> Result<Record, PipelineError> {
        let inputs = self.hashes(&self.inputs)?;
        let hash = self.hash(&inputs);
        if let Some(record) = self.record().filter(|r| r.hash == hash && self.is_intact(r)) {
            tracing::info!("{label}: up to date");
            observer.skip(self.cost);
            return Ok(record);
        }
        observer.begin(label, self.cost);
        let started = Instant::now();
        let product = work(&|fraction| observer.at(fraction))?;
        let record = self.commit(product, inputs, hash, started)?;
        observer.end();
        tracing::info!("{label}: {:.1} s", started.elapsed().as_secs_f64());
        Ok(record)
    }

    /// What the folder's `report.json` says of this stage; `None` where it says nothing or cannot be read.
    pub fn record(&self) -> Option<Record> {
        read_report(&self.folder).stages.remove(self.name)
    }

    fn hash(&self, inputs: &BTreeMap<String, String>) -> String {
        let what = json!([PROGRAM, self.name, self.version, inputs, self.settings]);
        hash::bytes(what.to_string().as_bytes())
    }

    fn hashes(&self, paths: &[PathBuf]) -> Result<BTreeMap<String, String>, PipelineError> {
        paths.iter().map(|p| Ok((self.relative(p), hash::file(p)?))).collect()
    }

    fn relative(&self, path: &Path) -> String {
        match path.strip_prefix(self.root) {
            Ok(inside) => inside.to_string_lossy().into_owned(),
            // Only the name: where a file lay must not change what is written.
            Err(_) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
        }
    }

    fn is_intact(&self, record: &Record) -> bool {
        if self.outputs_vary {
            return self.outputs.iter().all(|p| p.is_file());
        }
        self.hashes(&self.outputs).is_ok_and(|now| now == record.outputs)
    }

    fn commit(
        &self,
        product: Product,
        inputs: BTreeMap<String, String>,
        hash: String,
        started: Instant,
    ) -> Result<Record, PipelineError> {
        let hash_of = |bytes: &[u8]| if self.outputs_vary { String::new() } else { hash::bytes(bytes) };
        let outputs = product.files.iter().map(|(p, bytes)| (self.relative(p), hash_of(bytes))).collect();
        let (settings, version) = (self.settings.clone(), self.version);
        let Product { files, result, warnings, lost, failures, timings } = product;
        let record = Record { version, hash, inputs, settings, outputs, result, warnings, lost, failures };
        disk::write_all_whole(&files)?;
        self.write_timings(timings, started)?;
        let mut report = read_report(&self.folder);
        report.program = PROGRAM.into();
        report.stages.insert(self.name.into(), record.clone());
        disk::write_whole(&self.folder.join("report.json"), &pretty(&report)?)?;
        Ok(record)
    }

    fn write_timings(&self, detail: Value, started: Instant) -> Result<(), PipelineError> {
        let path = self.folder.join("timings.json");
        let mut all: BTreeMap<String, Value> =
            std::fs::read(&path).ok().and_then(|b| serde_json::from_slice(&b).ok()).unwrap_or_default();
        let mut mine = json!({
            "seconds": (started.elapsed().as_secs_f64() * 1e3).round() / 1e3,
            "peak_memory_bytes": memory::peak_bytes(),
            "threads": rayon::current_num_threads(),
        });
        if let (Some(mine), Value::Object(detail)) = (mine.as_object_mut(), detail) {
            mine.extend(detail);
        }
        all.insert(self.name.into(), mine);
        disk::write_whole(&path, &pretty(&all)?)
    }
}

fn read_report(folder: &Path) -> Report {
    let bytes = std::fs::read(folder.join("report.json")).unwrap_or_default();
    serde_json::from_slice(&bytes).unwrap_or_default()
}

/// A value as JSON with the shortest digits that give its numbers back (`json!` widens f32 first: 0.10000000149).
///
/// # Errors
/// [`PipelineError::Format`] where a value cannot be written as JSON.
pub fn plain(value: &impl Serialize) -> Result<Value, PipelineError> {
    let text = serde_json::to_vec(value).and_then(|bytes| serde_json::from_slice(&bytes));
    text.map_err(|e| PipelineError::format(Path::new("JSON"), e))
}

/// JSON as the project writes it: indented, keys in a fixed order, a line break at the end.
///
/// # Errors
/// [`PipelineError::Format`] where a value cannot be written as JSON.
pub fn pretty(value: &impl Serialize) -> Result<Vec<u8>, PipelineError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|e| PipelineError::format(Path::new("JSON"), e))?;
    bytes.push(b'\n');
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, fs};

    use super::*;
    use crate::observer::Silent;

    struct Bench {
        dir: tempfile::TempDir,
        runs: Cell<u32>,
    }

    impl Bench {
        fn new() -> Self {
            let dir = tempfile::tempdir().unwrap();
            fs::write(dir.path().join("in"), b"take").unwrap();
            Self { dir, runs: Cell::new(0) }
        }

        fn run(&self, settings: Value) -> Result<Record, PipelineError> {
            let root = self.dir.path();
            let stage = Stage {
                name: "fuse",
                version: 1,
                cost: 1.0,
                root,
                folder: root.join("build"),
                inputs: vec![root.join("in")],
                settings,
                outputs: vec![root.join("build/out")],
                outputs_vary: false,
            };
            stage.run("test", &Silent, |_| {
                self.runs.set(self.runs.get() + 1);
                let bytes = fs::read(root.join("in")).unwrap();
                Ok(Product {
                    files: vec![(root.join("build/out"), bytes)],
                    result: json!({"n": 4}),
                    ..Product::default()
                })
            })
        }
    }

    #[test]
    fn the_same_is_not_done_twice() {
        let bench = Bench::new();
        let first = bench.run(json!({"voxel": 1})).unwrap();
        assert_eq!(bench.run(json!({"voxel": 1})).unwrap(), first);
        assert_eq!(bench.runs.get(), 1);
        assert_eq!(fs::read(bench.dir.path().join("build/out")).unwrap(), b"take");
    }

    #[test]
    fn other_input_settings_or_a_damaged_output_is_done_again() {
        let bench = Bench::new();
        bench.run(json!(1)).unwrap();
        bench.run(json!(2)).unwrap();
        assert_eq!(bench.runs.get(), 2);
        fs::write(bench.dir.path().join("in"), b"retake").unwrap();
        bench.run(json!(2)).unwrap();
        assert_eq!(bench.runs.get(), 3);
        fs::write(bench.dir.path().join("build/out"), b"dam").unwrap();
        bench.run(json!(2)).unwrap();
        assert_eq!(bench.runs.get(), 4);
        fs::remove_file(bench.dir.path().join("build/out")).unwrap();
        bench.run(json!(2)).unwrap();
        assert_eq!(bench.runs.get(), 5);
        fs::write(bench.dir.path().join("build/report.json"), b"{ torn").unwrap();
        bench.run(json!(2)).unwrap();
        assert_eq!(bench.runs.get(), 6);
    }

    #[test]
    fn numbers_stay_short() {
        assert_eq!(plain(&0.1f32).unwrap().to_string(), "0.1");
        assert_eq!(plain(&[1.5f32, 2.0]).unwrap(), json!([1.5, 2.0]));
    }

    #[test]
    fn a_full_disk_leaves_no_record() {
        let bench = Bench::new();
        fs::create_dir(bench.dir.path().join("build")).unwrap();
        let part = bench.dir.path().join("build/out.part");
        std::os::unix::fs::symlink("/dev/full", part).unwrap();
        assert!(matches!(bench.run(json!(1)), Err(PipelineError::DiskFull { .. })));
        assert!(!bench.dir.path().join("build/report.json").exists());
        bench.run(json!(1)).unwrap();
        assert_eq!(bench.runs.get(), 2);
    }
}

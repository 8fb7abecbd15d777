//! Imports a folder of images as a recording and says what is in it:
//! `cargo run --release -p toile-capture --example import_folder -- FOLDER OUT.mcap [STANDARD.mcap]`.
#![allow(clippy::print_stdout)]

use std::{path::PathBuf, time::Instant};

use toile_capture::{CaptureError, Recorder, RecorderOptions, export_standard, import, inspect};

fn main() -> Result<(), CaptureError> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [folder, out, rest @ ..] = paths.as_slice() else {
        println!("usage: import_folder FOLDER OUT.mcap [STANDARD.mcap]");
        return Ok(());
    };
    let start = Instant::now();
    let mut source = import::open(folder, None)?;
    let recorder = Recorder::create(out, source.rig(), RecorderOptions::default())?;
    let report = import::record(source.as_mut(), recorder, &|_| ())?;
    println!("{report}; {} bytes in {:.2} s", report.bytes, start.elapsed().as_secs_f64());
    let start = Instant::now();
    println!("{}\nlooked through in {:.2} s", inspect(out)?, start.elapsed().as_secs_f64());
    if let [standard, ..] = rest {
        println!("{} bytes with depth as 16UC1", export_standard(out, standard)?.bytes);
    }
    Ok(())
}

//! The findings of an inspection, for people.

use std::fmt::{self, Write};

use super::findings::{Inspection, ScanInspection, TakeInspection};
use crate::printable;

impl fmt::Display for Inspection {
    /// The report for people; several lines.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::new();
        match &self.subject {
            Some(subject) => writeln!(
                text,
                "{}: subject {}, {}",
                printable(&self.path),
                printable(&subject.name),
                printable(&subject.date)
            )?,
            None => writeln!(text, "{}", printable(&self.path))?,
        }
        if self.takes.is_empty() {
            writeln!(text, "  no takes yet")?;
        }
        for take in &self.takes {
            write_take(&mut text, take)?;
        }
        f.write_str(text.trim_end())
    }
}

fn write_take(text: &mut String, take: &TakeInspection) -> fmt::Result {
    let garment = take.garment.as_ref().map_or_else(String::new, |garment| format!(" ({})", printable(garment)));
    let size = if take.bytes > 0 { format!(", {:.1} MB", take.bytes as f64 * 1e-6) } else { String::new() };
    let content = take.scan.as_ref().map_or_else(|| format!("{} frames, {:.1} s", take.frames, take.duration_s), mesh);
    writeln!(text, "  {}{garment}: {}, {content}{size}", printable(&take.name), take.format)?;
    for sensor in &take.sensors {
        let [width, height] = sensor.depth_size;
        let color = sensor.color_size.map_or_else(|| "no colour".to_string(), |[w, h]| format!("colour {w} x {h}"));
        let identity = [&sensor.model, &sensor.serial].map(String::as_str).join(" ");
        writeln!(
            text,
            "    {} [{}]: depth {width} x {height}, {color}, {} frames at {:.1} a second, {} lost, {:.0} % of depth valid",
            printable(&sensor.name),
            printable(identity.trim()),
            sensor.frames,
            sensor.fps_measured,
            sensor.lost_frames,
            100.0 * sensor.depth_valid_share
        )?;
    }
    for problem in &take.problems {
        writeln!(text, "    ! {}", printable(problem))?;
    }
    if take.problems.is_empty() {
        writeln!(text, "    healthy")?;
    }
    Ok(())
}

/// A finished scan in some words.
fn mesh(scan: &ScanInspection) -> String {
    let unit = scan.unit.as_deref().unwrap_or("of no known unit");
    let how = if scan.unit_said || scan.unit.is_none() { "" } else { " (found by its size)" };
    let colors = match (scan.has_colors, scan.pictures) {
        (false, _) => "no colours".to_string(),
        (true, 0) => "colours".to_string(),
        (true, count) => format!("colours of {count} pictures"),
    };
    let up = scan.up_said.as_ref().map_or_else(String::new, |up| format!(", {} up", printable(up)));
    format!("{}, {} triangles, {unit}{how}{up}, {colors}", printable(&scan.file), scan.triangles)
}

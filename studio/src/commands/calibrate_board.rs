//! Cameras by a chessboard or a ChArUco board: rigs from a recording, stereo pairs from pictures.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
    str::FromStr,
};

use serde_json::json;
use toile_calibration::{
    Board, CalibratedRig, CalibrationError, Charuco, Corner, Dictionary, Grey, Sighting, View, calibrate, find_charuco,
    find_corners, views_of,
};
use toile_capture::{
    ColorImage, Frame, Replay, RgbImage, Sensor, Source, atomic_write, files::read_bytes, printable_path,
};
use toile_geometry::{Rigid, camera::PinholeCamera};
use toile_live::SensorPlace;

use crate::{StudioError, outcome::Answer};

/// Pictures of a recording that are looked at, for each camera, at most.
const MOST: usize = 400;

/// A board as the command line names it: `9x6,25`, or `5x7,40,30,DICT_4X4_50` with markers.
#[derive(Debug, Clone, Copy)]
pub enum BoardChoice {
    /// Plain.
    Chessboard(Board),
    /// With markers.
    Charuco(Charuco),
}

impl FromStr for BoardChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is no board; write inner corners and millimetres, such as 9x6,25, or of a ChArUco board squares across and \
                 down, millimetres of a square and of a marker, and the dictionary, such as 5x7,40,30,DICT_4X4_50"
            )
        };
        let (size, rest) = text.split_once(',').ok_or_else(wrong)?;
        let (a, b) = size.split_once('x').ok_or_else(wrong)?;
        let [a, b] = [a, b].map(|n| n.trim().parse::<usize>().map_err(|_| wrong()));
        let (a, b) = (a?, b?);
        let length =
            |word: &str| word.trim().parse::<f64>().ok().filter(|mm| mm.is_finite() && *mm > 0.0).map(|mm| 1e-3 * mm);
        let too_small =
            || format!("`{text}`: a board has 3 to 50 inner corners along each side, and squares above 0 mm");
        let Some((edge, rest)) = rest.split_once(',') else {
            rest.trim().parse::<f64>().map_err(|_| wrong())?;
            let square_m =
                length(rest).filter(|_| (3..=50).contains(&a.min(b)) && a.max(b) <= 50).ok_or_else(too_small)?;
            return Ok(Self::Chessboard(Board { columns: a.max(b), rows: a.min(b), square_m }));
        };
        let (marker, dictionary) = rest.split_once(',').ok_or_else(wrong)?;
        let (dictionary, is_legacy) =
            dictionary.strip_suffix(",legacy").map_or((dictionary, false), |name| (name, true));
        let dictionary: Dictionary = dictionary.trim().parse().map_err(|reason| format!("`{text}`: {reason}"))?;
        let (square_m, marker_m) = length(edge).zip(length(marker)).ok_or_else(wrong)?;
        if !(3..=50).contains(&a.min(b)) || a.max(b) > 50 || marker_m >= square_m {
            return Err(format!(
                "`{text}`: a ChArUco board has 3 to 50 squares along each side, and markers smaller than its squares"
            ));
        }
        if dictionary.count < (a * b).div_ceil(2) {
            return Err(format!(
                "`{text}`: {} markers are too few for {} white squares",
                dictionary.count,
                (a * b).div_ceil(2)
            ));
        }
        Ok(Self::Charuco(Charuco { columns: a, rows: b, square_m, marker_m, dictionary, is_legacy }))
    }
}

impl BoardChoice {
    /// Its inner corners.
    fn board(&self) -> Board {
        match self {
            Self::Chessboard(board) => *board,
            Self::Charuco(charuco) => charuco.board(),
        }
    }

    /// The corners that are seen of it in a picture: all of a plain board, some of one with markers.
    fn find(&self, picture: &Grey) -> Option<Vec<Corner>> {
        match self {
            Self::Chessboard(board) => find_corners(picture, board).map(Corner::all),
            Self::Charuco(charuco) => find_charuco(picture, charuco),
        }
    }

    /// True where half a turn of the board can be seen.
    fn has_a_first_corner(&self) -> bool {
        match self {
            Self::Chessboard(board) => board.has_a_first_corner(),
            Self::Charuco(_) => true,
        }
    }
}

/// Where the sensors of a recording stand, by a board that their colour cameras see.
pub(super) fn calibrate_take(
    take: &Path,
    board: &BoardChoice,
    find_lenses: bool,
) -> Result<(Vec<SensorPlace>, Answer), StudioError> {
    let mut source = Replay::open(take)?;
    let sensors = source.rig().sensors.clone();
    if let Some(sensor) = sensors.iter().find(|s| s.color.is_none()) {
        return Err(StudioError::refused(
            take,
            format!("`{}` has no colour camera that could see a board", sensor.name),
        ));
    }
    if sensors.len() > 1 && !board.has_a_first_corner() {
        let reason = "--board: a board that looks the same after half a turn does not tell cameras apart; use one whose inner \
                      corners are an odd number along one side and an even one along the other, or a ChArUco board";
        return Err(StudioError::Usage(reason.into()));
    }
    let (sightings, looked_at) = sightings(&mut source, sensors.len(), board)?;
    let lens = |s: &Sensor| s.color.filter(|_| !find_lenses).ok_or(s.color.map_or((0, 0), |c| (c.width, c.height)));
    let names: Vec<String> = sensors.iter().map(|s| s.name.clone()).collect();
    let lenses: Vec<_> = sensors.iter().map(lens).collect();
    let rig = calibrate(&names, &lenses, &views_of(&sightings, sensors.len()), &board.board())
        .map_err(|e| refused(take, &e, looked_at))?;
    let first = sensors[0].rig_from_depth * sensors[0].color_from_depth.inverse();
    let place = |(sensor, camera_from_first): (&Sensor, &Rigid)| {
        let rig_from_depth = first * camera_from_first.inverse() * sensor.color_from_depth;
        SensorPlace {
            name: sensor.name.clone(),
            position: rig_from_depth.translation.vector.into(),
            rotation: rig_from_depth.rotation.scaled_axis().map(f64::to_degrees).into(),
        }
    };
    let places: Vec<SensorPlace> = sensors.iter().zip(&rig.camera_from_first).map(place).collect();
    let results =
        places.iter().map(|p| json!({ "name": p.name, "position_m": p.position, "rotation_deg": p.rotation }));
    let results = results.collect::<Vec<_>>();
    Ok((places, answer_of(&names, &rig, json!({ "sensors": results, "lenses": rig.cameras, "rms_px": rig.rms_px }))))
}

fn refused(path: &Path, error: &CalibrationError, looked_at: usize) -> StudioError {
    StudioError::refused(path, format!("{error} ({looked_at} pictures were looked at)"))
}

/// The boards in a recording's colour pictures by the host's time, and how many pictures were looked at.
fn sightings(source: &mut Replay, cameras: usize, board: &BoardChoice) -> Result<(Vec<Sighting>, usize), StudioError> {
    let step = (source.len() as usize).div_ceil(MOST * cameras.max(1)).max(1);
    let (mut found, mut looked_at) = (Vec::new(), 0);
    let mut seen = vec![0; cameras];
    while let Some(frame) = source.next_frame()? {
        let Some(count) = seen.get_mut(frame.sensor) else { continue };
        *count += 1;
        let Some(picture) = picture_of(&frame).filter(|_| (*count - 1) % step == 0) else { continue };
        looked_at += 1;
        if let Some(corners) = board.find(&grey(&picture)) {
            found.push(Sighting { camera: frame.sensor, time_ns: frame.host_time_ns, corners });
        }
    }
    Ok((found, looked_at))
}

fn picture_of(frame: &Frame) -> Option<std::sync::Arc<RgbImage>> {
    frame.color.as_ref()?.decode(frame.index).ok()
}

fn grey(picture: &RgbImage) -> Grey {
    Grey::from_rgb(picture.width as usize, picture.height as usize, &picture.pixels)
}

/// The calibration of a stereo rig from pairs of pictures, written as OpenCV writes it.
pub(super) fn calibrate_pairs(
    out: &Path,
    board: &BoardChoice,
    sides: [&Vec<PathBuf>; 2],
) -> Result<Answer, StudioError> {
    if sides[0].len() != sides[1].len() {
        let reason = format!("--left has {} pictures, --right {}; they must be pairs", sides[0].len(), sides[1].len());
        return Err(StudioError::Usage(reason));
    }
    let (mut views, mut missed) = (Vec::new(), Vec::new());
    let mut sizes = [None, None];
    for (camera, side) in sides.into_iter().enumerate() {
        for (moment, path) in side.iter().enumerate() {
            let picture = read_picture(path, moment)?;
            let size = (picture.width, picture.height);
            if *sizes[camera].get_or_insert(size) != size {
                return Err(StudioError::refused(path, "has another size than the pictures before it"));
            }
            if let Some(corners) = board.find(&grey(&picture)) {
                views.push(View { camera, moment, corners });
            } else {
                let is_charuco = matches!(board, BoardChoice::Charuco(_));
                let what = if is_charuco { "two markers of the board are" } else { "the whole board is" };
                missed.push(format!("{}: {what} not seen; left out", printable_path(path)));
            }
        }
    }
    let names = ["left".to_string(), "right".to_string()];
    let lenses: Vec<Result<PinholeCamera, (u32, u32)>> = sizes.iter().map(|s| Err(s.unwrap_or((0, 0)))).collect();
    let rig = calibrate(&names, &lenses, &views, &board.board()).map_err(|e| refused(out, &e, 2 * sides[0].len()))?;
    atomic_write(out, opencv_yaml(&rig).as_bytes())?;
    let baseline = rig.camera_from_first[1].translation.vector.norm();
    let mut answer =
        answer_of(&names, &rig, json!({ "lenses": rig.cameras, "rms_px": rig.rms_px, "baseline_m": baseline }));
    let _ = writeln!(answer.text, "{}: baseline {:.2} mm", printable_path(out), 1e3 * baseline);
    answer.warnings = missed;
    Ok(answer)
}

fn read_picture(path: &Path, index: usize) -> Result<std::sync::Arc<RgbImage>, StudioError> {
    let bytes = read_bytes(path)?;
    let is_png = bytes.starts_with(b"\x89PNG");
    let image = if is_png { ColorImage::Png(bytes.into()) } else { ColorImage::Jpeg(bytes.into()) };
    image.decode(index as u64).map_err(|e| StudioError::format(path, e))
}

fn answer_of(names: &[String], rig: &CalibratedRig, results: serde_json::Value) -> Answer {
    let mut text = String::new();
    for (c, name) in names.iter().enumerate() {
        let PinholeCamera { fx, fy, cx, cy, .. } = rig.cameras[c];
        let _ = writeln!(
            text,
            "{name}: {} pictures with the board, {} of them shared; corners fit to {:.2} pixels; focal lengths {fx:.1} {fy:.1}, \
             principal point {cx:.1} {cy:.1}",
            rig.views[c], rig.shared[c], rig.rms_px[c]
        );
    }
    Answer { text, results, ..Answer::default() }
}

/// M1 D1 M2 D2 R T, in metres.
fn opencv_yaml(rig: &CalibratedRig) -> String {
    let mut text = String::from("%YAML:1.0\n---\n");
    let _ = writeln!(text, "image_width: {}\nimage_height: {}", rig.cameras[0].width, rig.cameras[0].height);
    let mut matrix = |name: &str, rows: usize, columns: usize, data: &[f64]| {
        let numbers: Vec<String> = data.iter().map(|v| format!("{v:.12e}")).collect();
        let data = numbers.join(", ");
        let _ = writeln!(
            text,
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]"
        );
    };
    for (k, c) in rig.cameras.iter().enumerate() {
        matrix(&format!("M{}", k + 1), 3, 3, &[c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0]);
        matrix(&format!("D{}", k + 1), 1, 5, &c.distortion);
    }
    let right_from_left = &rig.camera_from_first[1];
    let rotation = right_from_left.rotation.to_rotation_matrix();
    let rows: Vec<f64> = (0..9).map(|k| rotation[(k / 3, k % 3)]).collect();
    matrix("R", 3, 3, &rows);
    matrix("T", 3, 1, right_from_left.translation.vector.as_slice());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_are_read_and_others_refused() {
        let board = |text: &str| text.parse::<BoardChoice>().unwrap();
        assert!(matches!(board("6x9,25"), BoardChoice::Chessboard(Board { columns: 9, rows: 6, square_m: 0.025 })));
        let BoardChoice::Charuco(charuco) = board("5x7,40,30,DICT_4X4_50") else { panic!("it has markers") };
        assert_eq!((charuco.columns, charuco.rows, charuco.square_m, charuco.marker_m), (5, 7, 0.04, 0.03));
        assert_eq!((charuco.dictionary.squares, charuco.board().count(), charuco.is_legacy), (4, 24, false));
        assert!(matches!(board("8x6,40,30,5x5_100,legacy"), BoardChoice::Charuco(Charuco { is_legacy: true, .. })));
        for (text, words) in [
            ("9x6", "no board"),
            ("2x6,25", "3 to 50"),
            ("9x6,0", "above 0"),
            ("axb,1", "no board"),
            ("5x7,40,30", "no board"),
            ("5x7,40,50,4x4_50", "smaller than"),
            ("12x9,40,30,4x4_50", "too few for 54"),
            ("5x7,40,30,DICT_7X7_50", "DICT_6X6"),
        ] {
            assert!(text.parse::<BoardChoice>().unwrap_err().contains(words), "{text}");
        }
    }
}

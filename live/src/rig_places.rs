//! Where calibration found the sensors to stand, entered into a rig file; all else in it stays as it was written.

use std::fmt::Write;

/// Where a sensor stands.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorPlace {
    /// Its name.
    pub name: String,
    /// Its depth camera in the rig's frame, metres.
    pub position: [f64; 3],
    /// How it is turned there: axis times angle, degrees.
    pub rotation: [f64; 3],
}

/// The text of a rig file with the `position` and `rotation` of each sensor replaced. Sensors are found by `name`, those
/// without one in the order of the file.
///
/// # Errors
/// A sentence where file and sensors do not belong together, or a value cannot be replaced.
pub fn with_places(text: &str, places: &[SensorPlace]) -> Result<String, String> {
    let names = super::rig_file::names(text)?;
    if names.len() != places.len() {
        return Err(format!("names {} sensors, the recording has {}", names.len(), places.len()));
    }
    let of = |(k, name): (usize, &Option<String>)| match name {
        Some(name) => places.iter().find(|p| p.name == *name).ok_or_else(|| {
            let known: Vec<&str> = places.iter().map(|p| p.name.as_str()).collect();
            format!("names a sensor `{name}`; the recording has {}", known.join(", "))
        }),
        None => Ok(&places[k]),
    };
    let mut ordered = names.iter().enumerate().map(of).collect::<Result<Vec<_>, _>>()?.into_iter();
    let mut out = String::with_capacity(text.len() + 100 * places.len());
    let mut is_in_sensor = false;
    for line in text.lines() {
        let key = line.split('=').next().unwrap_or("").trim();
        if is_in_sensor && matches!(key, "position" | "rotation") {
            if !line.contains(']') {
                return Err(format!("{key} must stand on one line to be replaced"));
            }
            continue;
        }
        let _ = writeln!(out, "{line}");
        if line.trim_start().starts_with('[') {
            is_in_sensor = line.replace(' ', "").starts_with("[[sensor]]");
            if let Some(place) = is_in_sensor.then(|| ordered.next()).flatten() {
                let numbers = |v: &[f64; 3]| format!("[{:.6}, {:.6}, {:.6}]", v[0], v[1], v[2]);
                let _ = writeln!(out, "position = {}", numbers(&place.position));
                let _ = writeln!(out, "rotation = {}", numbers(&place.rotation));
            }
        }
    }
    super::rig_file::names(&out)?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(name: &str, x: f64) -> SensorPlace {
        SensorPlace { name: name.into(), position: [x, 0.0, 1.0], rotation: [0.0, 90.0 * x, 0.0] }
    }

    #[test]
    fn places_are_replaced_and_all_else_stays() {
        let text = "# our rig\n[[sensor]]\ndevice = \"kinect1:A\"  # front\n\n[[sensor]]\ndevice = \"kinect1:B\"\n\
                    name = \"back\"\nposition = [9.0, 9.0, 9.0] # by tape\n";
        let new = with_places(text, &[place("camera", 0.0), place("back", 2.0)]).unwrap();
        assert!(new.starts_with("# our rig\n[[sensor]]\nposition = [0.000000, 0.000000, 1.000000]\n"), "{new}");
        assert!(new.contains("device = \"kinect1:A\"  # front\n") && !new.contains("9.0"), "{new}");
        assert!(
            new.contains("[[sensor]]\nposition = [2.000000, 0.000000, 1.000000]\nrotation = [0.000000, 180.0"),
            "{new}"
        );
        assert_eq!(with_places(&new, &[place("camera", 0.0), place("back", 2.0)]).unwrap(), new);
    }

    #[test]
    fn a_file_of_other_sensors_is_refused() {
        let text = "[[sensor]]\ndevice = \"kinect1\"\nname = \"front\"\n";
        assert!(with_places(text, &[]).unwrap_err().contains("names 1 sensors"));
        assert!(with_places(text, &[place("side", 1.0)]).unwrap_err().contains("`front`"));
        let split = "[[sensor]]\ndevice = \"kinect1\"\nposition = [\n0.0, 0.0, 0.0]\n";
        assert!(with_places(split, &[place("side", 1.0)]).unwrap_err().contains("one line"));
    }
}

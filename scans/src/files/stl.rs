//! STL: triangles without anything else, binary or text. Its author named no unit.

use nalgebra::Point3;

use crate::Surface;

/// Bytes of the binary form before the first triangle, and of a triangle.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// Decodes an STL file: binary where its length is that of as many triangles as it says, otherwise text.
///
/// # Errors
/// A sentence that says what is wrong.
pub fn decode_stl(bytes: &[u8]) -> Result<Surface, String> {
    let count = bytes.get(80..HEAD).and_then(|b| b.first_chunk::<4>()).map(|b| u32::from_le_bytes(*b) as usize);
    let needed = count.and_then(|count| count.checked_mul(TRIANGLE)?.checked_add(HEAD));
    let corners = match (count, needed) {
        // Text may begin with any 84 characters, but does not have exactly this length.
        (Some(count), Some(needed)) if needed <= bytes.len() && !(is_text(bytes) && needed != bytes.len()) => {
            binary(&bytes[HEAD..], count)
        }
        _ if is_text(bytes) => text(bytes)?,
        (Some(count), _) => {
            return Err(format!("is cut off: it announces {count} triangles, but holds {} bytes", bytes.len()));
        }
        _ => return Err("is not an STL file: it is shorter than the head of one".into()),
    };
    let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mut surface = Surface::new(corners, triangles);
    surface.validate()?;
    surface.weld();
    Ok(surface)
}

fn is_text(bytes: &[u8]) -> bool {
    let head = bytes.get(..bytes.len().min(512)).unwrap_or_default();
    head.trim_ascii_start().starts_with(b"solid") && head.windows(5).any(|word| word.eq_ignore_ascii_case(b"facet"))
}

fn binary(bytes: &[u8], count: usize) -> Vec<Point3<f32>> {
    let number =
        |at: &[u8], k: usize| at.get(4 * k..4 * k + 4).map_or(0.0, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let triangles = bytes.chunks_exact(TRIANGLE).take(count);
    triangles.flat_map(|t| [3, 6, 9].map(|k| Point3::new(number(t, k), number(t, k + 1), number(t, k + 2)))).collect()
}

fn text(bytes: &[u8]) -> Result<Vec<Point3<f32>>, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut corners = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if !words.next().is_some_and(|word| word.eq_ignore_ascii_case("vertex")) {
            continue;
        }
        let mut next = || words.next()?.parse::<f32>().ok();
        let (x, y, z) = (next(), next(), next());
        let point = x.zip(y).zip(z).map(|((x, y), z)| Point3::new(x, y, z));
        corners.push(point.ok_or_else(|| format!("line {}: a vertex needs three numbers", number + 1))?);
    }
    if !corners.len().is_multiple_of(3) {
        return Err(format!("is cut off: its {} vertices do not make whole triangles", corners.len()));
    }
    Ok(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid two of them\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n VERTEX 0 1e0 0\n \
        endloop\n endfacet\n facet normal 0 0 1\n outer loop\n vertex 1 0 0\n vertex 1 1 0\n vertex 0 1 0\n endloop\n endfacet\n";

    fn as_binary() -> Vec<u8> {
        // "solid" as the first word of a binary file is the classic trap.
        let mut bytes = b"solid but binary".to_vec();
        bytes.resize(80, b' ');
        bytes.extend(2_u32.to_le_bytes());
        for t in [[[0, 0], [1, 0], [0, 1]], [[1, 0], [1, 1], [0, 1]]] {
            bytes.extend([0; 12]);
            t.iter().for_each(|[x, y]| [*x as f32, *y as f32, 0.0].iter().for_each(|c| bytes.extend(c.to_le_bytes())));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_give_the_same_two_triangles_with_one_edge_in_common() {
        for bytes in [TEXT.as_bytes().to_vec(), as_binary()] {
            let surface = decode_stl(&bytes).unwrap();
            assert_eq!((surface.positions.len(), surface.triangles), (4, vec![[0, 1, 2], [1, 3, 2]]));
        }
    }

    #[test]
    fn what_is_cut_off_or_something_else_is_said() {
        let binary = as_binary();
        assert!(decode_stl(&binary[..150]).unwrap_err().contains("cut off"));
        assert!(decode_stl(b"short").unwrap_err().contains("not an STL file"));
        let torn = TEXT.split_once("vertex 0 1 0\n endloop\n endfacet\n").map_or(TEXT, |(before, _)| before);
        assert!(decode_stl(torn.as_bytes()).unwrap_err().contains("whole triangles"));
        assert!(decode_stl(TEXT.replace("1e0", "one").as_bytes()).unwrap_err().contains("line 6"));
        assert!(decode_stl(TEXT.replace("1e0", "inf").as_bytes()).unwrap_err().contains("not finite"));
    }
}

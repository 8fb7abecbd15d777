//! Vertices over time: PC2 files, version 1, as Blender's Mesh Cache modifier reads them.
//!
//! A header of 32 bytes (`POINTCACHE2\0`, version, points, first frame, frames a sample, samples), then the points of each
//! sample as three 32-bit floats, little-endian.

use std::io::{self, Write};

use nalgebra::Point3;

/// Writes the samples of a point cache one after the other.
#[derive(Debug)]
pub struct PointCache<W: Write> {
    out: W,
    points: usize,
    left: u32,
    bytes: Vec<u8>,
}

impl<W: Write> PointCache<W> {
    /// Begins a cache of `samples` samples of `points` points, one a frame.
    ///
    /// # Errors
    /// Those of the writer; [`io::ErrorKind::InvalidInput`] where the format cannot count so many points.
    pub fn begin(mut out: W, points: usize, samples: u32) -> io::Result<Self> {
        let invalid = |what: &str| io::Error::new(io::ErrorKind::InvalidInput, what);
        let count = i32::try_from(points).map_err(|_| invalid("more points than a point cache can hold"))?;
        let frames = i32::try_from(samples).map_err(|_| invalid("more frames than a point cache can hold"))?;
        out.write_all(b"POINTCACHE2\0")?;
        out.write_all(&1i32.to_le_bytes())?;
        out.write_all(&count.to_le_bytes())?;
        out.write_all(&0f32.to_le_bytes())?;
        out.write_all(&1f32.to_le_bytes())?;
        out.write_all(&frames.to_le_bytes())?;
        Ok(Self { out, points, left: samples, bytes: Vec::with_capacity(points * 12) })
    }

    /// Goes on with a cache of which `written` of its samples are in `out` already, the next behind them.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidInput`] where that are more than all.
    pub fn go_on(out: W, points: usize, samples: u32, written: u32) -> io::Result<Self> {
        let left = samples.checked_sub(written);
        let left = left.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "more samples than all"))?;
        Ok(Self { out, points, left, bytes: Vec::with_capacity(points * 12) })
    }

    /// Where the samples go.
    pub fn out_mut(&mut self) -> &mut W {
        &mut self.out
    }

    /// Adds the next sample.
    ///
    /// # Errors
    /// Those of the writer; [`io::ErrorKind::InvalidInput`] for another number of points, or a sample too many.
    pub fn add(&mut self, points: &[Point3<f32>]) -> io::Result<()> {
        if points.len() != self.points || self.left == 0 {
            let reason = format!("{} points for a cache of {}, {} samples left", points.len(), self.points, self.left);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
        }
        self.left -= 1;
        self.bytes.clear();
        for c in points.iter().flat_map(|p| [p.x, p.y, p.z]) {
            self.bytes.extend_from_slice(&c.to_le_bytes());
        }
        self.out.write_all(&self.bytes)
    }

    /// Ends the cache and gives the writer back.
    ///
    /// # Errors
    /// Those of the writer; [`io::ErrorKind::InvalidInput`] where samples are missing.
    pub fn finish(mut self) -> io::Result<W> {
        if self.left > 0 {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{} samples are missing", self.left)));
        }
        self.out.flush()?;
        Ok(self.out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cache_has_its_header_and_its_samples() {
        let mut cache = PointCache::begin(Vec::new(), 2, 2).unwrap();
        let points = [Point3::new(1.0, 2.0, 3.0), Point3::new(-1.0, 0.5, 0.25)];
        cache.add(&points).unwrap();
        assert!(cache.add(&points[..1]).is_err());
        cache.add(&points).unwrap();
        assert!(cache.add(&points).is_err());
        let bytes = cache.finish().unwrap();
        assert_eq!(bytes.len(), 32 + 2 * 2 * 12);
        assert_eq!(&bytes[..12], b"POINTCACHE2\0");
        assert_eq!(bytes[12..20], [1, 0, 0, 0, 2, 0, 0, 0]);
        assert_eq!(bytes[28..32], 2i32.to_le_bytes());
        assert_eq!(bytes[32..36], 1f32.to_le_bytes());
        assert!(PointCache::begin(Vec::new(), 2, 2).unwrap().finish().is_err());
    }
}

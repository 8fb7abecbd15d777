//! A garment's mesh while it is made: its surface and typed values at each vertex.
//!
//! Names of values as text exist only where a mesh leaves this crate: in files, and in the steps of `toile-geometry` that
//! carry named attributes along ([`Draft::through`]).

use std::ops::{Index, IndexMut};

use nalgebra::Vector3;
use toile_geometry::{Mesh, holes::FILLED};

/// A value that every vertex of a garment's mesh has while it is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Channel {
    /// 1 where nothing was seen and a hole was closed.
    Filled,
    /// Probability of the vertex's label.
    Confidence,
    /// 1 where the scan ends or was closed without being seen, less around it.
    Unseen,
    /// Distance from what was worn before, metres.
    Clearance,
    /// The decisions of strokes: 1 where somebody said that it belongs, −1 that it does not.
    ByHand,
}

/// Every channel with the name that it has where values go by name.
const CHANNELS: [(Channel, &str); 5] = [
    (Channel::Filled, FILLED),
    (Channel::Confidence, CONFIDENCE),
    (Channel::Unseen, "unseen_around"),
    (Channel::Clearance, "clearance"),
    (Channel::ByHand, "by_hand"),
];

/// Name of a garment's vertex attribute: probability that the vertex belongs to it, 0.5 to 1.
pub const CONFIDENCE: &str = "confidence";

/// Values of all channels, each as long as the mesh has vertices.
#[derive(Debug, Clone, Default)]
pub(crate) struct Channels([Vec<f32>; CHANNELS.len()]);

impl Channels {
    /// All channels 0 at `count` vertices.
    pub fn zero(count: usize) -> Self {
        Self(std::array::from_fn(|_| vec![0.0; count]))
    }

    fn gather(&self, old_of_new: &[u32]) -> Self {
        Self(self.0.each_ref().map(|values| old_of_new.iter().map(|&v| values[v as usize]).collect()))
    }
}

impl Index<Channel> for Channels {
    type Output = Vec<f32>;

    fn index(&self, channel: Channel) -> &Vec<f32> {
        &self.0[channel as usize]
    }
}

impl IndexMut<Channel> for Channels {
    fn index_mut(&mut self, channel: Channel) -> &mut Vec<f32> {
        &mut self.0[channel as usize]
    }
}

/// A garment's mesh while it is made.
#[derive(Debug, Clone, Default)]
pub(crate) struct Draft {
    /// Positions, triangles, colours and normals.
    pub surface: Mesh,
    /// Values at its vertices.
    pub channels: Channels,
}

impl Draft {
    /// A mesh with all channels 0. Attributes are left behind.
    pub fn of(mesh: &Mesh) -> Self {
        let surface = Mesh { attributes: std::collections::BTreeMap::new(), ..mesh.clone() };
        Self { channels: Channels::zero(surface.positions.len()), surface }
    }

    /// The part whose triangles `keep`.
    pub fn filter(&self, keep: impl Fn(usize) -> bool) -> Self {
        let (surface, old_of_new) = self.surface.filter_triangles(keep);
        Self { surface, channels: self.channels.gather(&old_of_new) }
    }

    /// The draft after a step of `toile-geometry`, which carries named attributes along.
    pub fn through(self, step: impl FnOnce(&Mesh) -> Mesh) -> Self {
        let Self { mut surface, channels } = self;
        for ((_, name), values) in CHANNELS.iter().zip(channels.0) {
            surface.attributes.insert((*name).into(), values);
        }
        let mut surface = step(&surface);
        let channels = CHANNELS.map(|(_, name)| surface.attributes.remove(name).unwrap_or_default());
        Self { surface, channels: Channels(channels) }
    }

    /// Appends the vertex at share `t` of the way from vertex `a` to vertex `b`; returns its index.
    pub fn push_between(&mut self, a: usize, b: usize, t: f32) -> u32 {
        let mesh = &mut self.surface;
        mesh.positions.push(mesh.positions[a] + (mesh.positions[b] - mesh.positions[a]) * t);
        if !mesh.normals.is_empty() {
            let n = (mesh.normals[a] * (1.0 - t) + mesh.normals[b] * t).try_normalize(1e-12).unwrap_or(mesh.normals[a]);
            mesh.normals.push(n);
        }
        if !mesh.colors.is_empty() {
            let (x, y) = (mesh.colors[a], mesh.colors[b]);
            let mix = |k: usize| (f32::from(x[k]) * (1.0 - t) + f32::from(y[k]) * t).round() as u8;
            mesh.colors.push([mix(0), mix(1), mix(2)]);
        }
        self.channels.0.iter_mut().for_each(|values| values.push(values[a] * (1.0 - t) + values[b] * t));
        (self.surface.positions.len() - 1) as u32
    }

    /// Appends a copy of vertex `v`, moved by `by` metres and marked as not seen; returns its index.
    pub fn push_moved(&mut self, v: u32, by: Vector3<f32>) -> u32 {
        let (v, mesh) = (v as usize, &mut self.surface);
        mesh.positions.push(mesh.positions[v] + by);
        if !mesh.normals.is_empty() {
            mesh.normals.push(mesh.normals[v]);
        }
        if !mesh.colors.is_empty() {
            mesh.colors.push(mesh.colors[v]);
        }
        let new = mesh.positions.len() - 1;
        self.channels.0.iter_mut().for_each(|values| values.push(values[v]));
        self.channels[Channel::Filled][new] = 1.0;
        new as u32
    }

    /// The finished mesh, with what later stages read as attributes: [`FILLED`] and [`CONFIDENCE`].
    pub fn finished(self) -> Mesh {
        let Self { mut surface, mut channels } = self;
        for (channel, name) in [CHANNELS[0], CHANNELS[1]] {
            surface.attributes.insert(name.into(), std::mem::take(&mut channels[channel]));
        }
        surface.recompute_normals();
        surface
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn channels_are_where_their_names_say() {
        assert!(CHANNELS.iter().enumerate().all(|(k, (channel, _))| *channel as usize == k));
    }

    #[test]
    fn values_survive_a_step_by_name_and_new_vertices_have_theirs() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
        let mut draft = Draft::of(&Mesh::new(corners.to_vec(), vec![[0, 1, 2]]));
        draft.channels[Channel::Clearance] = vec![1.0, 3.0, 5.0];
        let mut draft = draft.through(Mesh::clone);
        assert!(draft.surface.attributes.is_empty());
        let between = draft.push_between(0, 1, 0.25) as usize;
        let moved = draft.push_moved(2, Vector3::z()) as usize;
        assert_eq!(
            (draft.channels[Channel::Clearance][between], draft.channels[Channel::Clearance][moved]),
            (1.5, 5.0)
        );
        assert_eq!((draft.channels[Channel::Filled][between], draft.channels[Channel::Filled][moved]), (0.0, 1.0));
    }
}

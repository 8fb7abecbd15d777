//! Which joints move a vertex, and how far.

/// Maximum number of joints that move a vertex (the number that importers read).
pub const INFLUENCES: usize = 4;

/// Joint influences of each vertex: indices and weights, largest first, weights sum to 1, unused slots (0, 0).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SkinWeights {
    /// Joint indices of each vertex.
    pub joints: Vec<[u8; INFLUENCES]>,
    /// Their weights.
    pub weights: Vec<[f32; INFLUENCES]>,
}

impl SkinWeights {
    /// Number of weighted vertices.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// True when no vertex is weighted.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Adds a vertex moved by `influences` (joint, weight), in any order and number: the four largest are kept
    /// (of equal ones the lower joint) and normalised; without a positive weight the vertex follows joint 0.
    pub fn push(&mut self, influences: &[(u8, f32)]) {
        let mut sorted: Vec<(u8, f32)> = Vec::with_capacity(influences.len());
        for &(joint, weight) in influences.iter().filter(|i| i.1 > 0.0) {
            match sorted.iter_mut().find(|s| s.0 == joint) {
                Some(slot) => slot.1 += weight,
                None => sorted.push((joint, weight)),
            }
        }
        sorted.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        sorted.truncate(INFLUENCES);
        if sorted.is_empty() {
            sorted.push((0, 1.0));
        }
        let sum: f32 = sorted.iter().map(|i| i.1).sum();
        let (mut joints, mut weights) = ([0; INFLUENCES], [0.0; INFLUENCES]);
        for (k, (joint, weight)) in sorted.into_iter().enumerate() {
            (joints[k], weights[k]) = (joint, weight / sum);
        }
        self.joints.push(joints);
        self.weights.push(weights);
    }

    /// Weights whose vertex i is vertex `old_of_new[i]` of these.
    pub fn gather(&self, old_of_new: &[u32]) -> Self {
        Self {
            joints: old_of_new.iter().map(|&v| self.joints[v as usize]).collect(),
            weights: old_of_new.iter().map(|&v| self.weights[v as usize]).collect(),
        }
    }

    /// Influences of vertex `v` with a weight above zero.
    pub fn of(&self, v: usize) -> impl Iterator<Item = (u8, f32)> + '_ {
        self.joints[v].into_iter().zip(self.weights[v]).filter(|i| i.1 > 0.0)
    }

    /// Weights at a point of a triangle (seed §5.2: closest triangle and barycentric coordinates), added as a vertex.
    pub fn push_interpolated(&mut self, source: &Self, triangle: [u32; 3], barycentric: [f32; 3]) {
        let mut influences = Vec::with_capacity(3 * INFLUENCES);
        for (v, b) in triangle.into_iter().zip(barycentric) {
            influences.extend(source.of(v as usize).map(|(j, w)| (j, w * b)));
        }
        self.push(&influences);
    }
}

//! The triangles around each vertex while edges are collapsed: chains of triangle corners.

/// No corner.
const NONE: u32 = u32::MAX;

/// Triangles, which of them are alive, and for each vertex the chain of its corners.
pub(super) struct Corners {
    pub(super) triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// First and last corner at each vertex, and the next corner after each corner.
    head: Vec<u32>,
    tail: Vec<u32>,
    next: Vec<u32>,
}

impl Corners {
    pub(super) fn new(triangles: Vec<[u32; 3]>, vertices: usize) -> Self {
        let mut corners =
            Self { triangles, alive: Vec::new(), head: vec![NONE; vertices], tail: Vec::new(), next: Vec::new() };
        corners.chain();
        corners
    }

    /// Drops dead triangles and chains the corners of the others.
    pub(super) fn chain(&mut self) {
        if !self.alive.is_empty() {
            let alive = std::mem::take(&mut self.alive);
            let mut at = 0;
            self.triangles.retain(|_| {
                at += 1;
                alive[at - 1]
            });
        }
        self.alive = vec![true; self.triangles.len()];
        self.head = vec![NONE; self.head.len()];
        self.tail = vec![NONE; self.head.len()];
        self.next = vec![NONE; self.triangles.len() * 3];
        for (corner, &v) in self.triangles.as_flattened().iter().enumerate() {
            let v = v as usize;
            match self.tail[v] {
                NONE => self.head[v] = corner as u32,
                last => self.next[last as usize] = corner as u32,
            }
            self.tail[v] = corner as u32;
        }
    }

    /// True where one triangle alone has the edge.
    #[inline]
    pub(super) fn is_single(&self, p: u32, q: u32) -> bool {
        self.triangles_at(p).filter(|&t| self.triangles[t as usize].contains(&q)).take(2).count() == 1
    }

    /// Triangles alive at a vertex.
    #[inline]
    pub(super) fn triangles_at(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let mut corner = self.head[v as usize];
        std::iter::from_fn(move || {
            while corner != NONE {
                let t = corner / 3;
                corner = self.next[corner as usize];
                if self.alive[t as usize] {
                    return Some(t);
                }
            }
            None
        })
    }

    /// Drops the triangles `shared` and gives the triangles `moving` of vertex `v` to vertex `u`.
    pub(super) fn merge(&mut self, u: u32, v: u32, shared: &[u32], moving: &[u32]) {
        for &t in shared {
            self.alive[t as usize] = false;
        }
        for &t in moving {
            self.triangles[t as usize].iter_mut().filter(|c| **c == v).for_each(|c| *c = u);
        }
        if self.head[v as usize] != NONE {
            self.next[self.tail[u as usize] as usize] = self.head[v as usize];
            self.tail[u as usize] = self.tail[v as usize];
            self.head[v as usize] = NONE;
        }
    }
}

//! What particles can hit: the rough surfaces of the layers below, as planes that move with them.

use rayon::prelude::*;

use super::{
    hit::{Below, HITS, Hit},
    rough::Rough,
};

impl Rough {
    /// Looks for what the particles can hit in the layers `below`, inside to outside: where more are near than there is space for, the
    /// outer ones.
    pub fn look<'b>(&mut self, below: impl Fn(usize) -> Below<'b> + Sync, count: usize) {
        let Self { hits, classes, places, from, to, heights, .. } = self;
        let heights = &*heights;
        hits.par_iter_mut().enumerate().with_min_len(64).for_each(|(v, hits)| {
            *hits = [Hit::NONE; HITS];
            if !classes[v].is_particle() {
                return;
            }
            let ahead = places[v] + (to[v] - from[v]);
            let mut k = 0;
            for j in (0..count).rev() {
                let hit = below(j).hit(&ahead, heights[j][v]);
                if hit.is_some() && k < HITS {
                    hits[k] = hit;
                    k += 1;
                }
            }
        });
    }
}

//! The plan of all contours of a person: which rays are cast, and how their hits are joined (paper 002 §2 and §3).
//!
//! The envelope has eleven pieces: trunk, chest and back, neck, and on each side shoulder, arm, hip and leg. Contours of
//! limbs and trunk are driven by joint angles, those between the rims of two pieces by the rims. Chest and back have four rims each,
//! two of them arm holes: there the paper's interpolation between two rims becomes that between four (Coons 1967), for rays' origins and
//! the points that they pass alike.

mod chest;
mod limbs;
mod links;
mod marks;
mod trunk;

use nalgebra::{Point3, Vector3};
use toile_character::BodyModel;

pub use self::marks::Marks;
use crate::{
    ImplicitError,
    body::ImplicitBody,
    bones::{Bones, Chain, Place},
    boundary::OnContour,
    extremities::Extremities,
    group::Group,
    level::Level,
};

/// A cross-section that joint angles drive.
#[derive(Debug, Clone)]
pub struct Section {
    /// The links.
    pub chain: Chain,
    /// The link that it lies on.
    pub link: usize,
    /// Where on the link.
    pub share: f64,
    /// The direction that angles count from, at rest.
    pub reference: Vector3<f64>,
}

/// How the ray of a point is found.
#[derive(Debug, Clone)]
pub enum Rule {
    /// Driven by joint angles: a section, and the angle about its normal.
    Ring {
        /// Index of the section.
        section: u32,
        /// Radians.
        angle: f64,
    },
    /// Driven by the rims that it lies between.
    Between {
        /// The point of the start contour.
        start: u32,
        /// The point of the goal contour.
        goal: u32,
        /// i / (k + 1).
        share: f64,
        /// The link.
        link: (Place, Place),
    },
    /// Between several points: origin and passed point are sums with these weights.
    Span(Vec<(u32, f64)>),
    /// Given: a place on the rim of an extremity. No ray is cast.
    Rim {
        /// Which extremity.
        extremity: u8,
        /// Where on its rim.
        place: OnContour,
    },
}

/// A point of a contour.
#[derive(Debug, Clone)]
pub struct Node {
    /// How its ray is found.
    pub rule: Rule,
    /// The group whose primitives its ray sees.
    pub group: Group,
    /// Nothing farther is looked at, metres; of points between others it follows from them.
    pub reach: f64,
}

/// The plan of all contours of a person.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The level that it was made for.
    pub level: Level,
    /// All points; those of rims come last and are no part of the mesh.
    pub nodes: Vec<Node>,
    /// Number of points of the mesh.
    pub count: usize,
    /// Its quadrilaterals, outward.
    pub quads: Vec<[u32; 4]>,
    /// Cross-sections.
    pub sections: Vec<Section>,
    /// Points by what they need: those of a phase need only points of earlier ones.
    pub phases: Vec<Vec<u32>>,
    /// The last contour before each extremity.
    pub ends: [Vec<u32>; 5],
}

/// A plan that grows.
struct Draft<'a> {
    bones: Bones,
    marks: Marks,
    level: Level,
    extremities: &'a Extremities,
    plan: Plan,
}

impl Plan {
    /// The plan for `body`.
    ///
    /// # Errors
    /// [`ImplicitError::Body`] where the template lacks a landmark, or the skeleton is not that of a person.
    pub fn new(
        model: &BodyModel,
        body: &ImplicitBody,
        extremities: &Extremities,
        level: Level,
    ) -> Result<Self, ImplicitError> {
        let bones = Bones::new(&body.skeleton, &toile_character::Pose::identity());
        let marks = Marks::new(model, body, &bones)?;
        let plan = Self {
            level,
            nodes: Vec::new(),
            count: 0,
            quads: Vec::new(),
            sections: Vec::new(),
            phases: vec![Vec::new(); 4],
            ends: Default::default(),
        };
        let mut draft = Draft { bones, marks, level, extremities, plan };
        let trunk = draft.trunk();
        let holes = draft.arm_holes(&trunk);
        let neck = draft.chest(&trunk, &holes);
        draft.neck(&neck);
        let seam = draft.seam();
        for (side, hole) in holes.iter().enumerate() {
            draft.arm(side, hole);
            draft.leg(side, &trunk, &seam);
        }
        Ok(draft.finished())
    }

    /// Every point's group, by node.
    pub fn groups(&self) -> impl Iterator<Item = Group> + '_ {
        self.nodes[..self.count].iter().map(|n| n.group)
    }
}

impl Draft<'_> {
    /// Adds a point that phase `phase` samples.
    fn node(&mut self, phase: usize, rule: Rule, group: Group, reach: f64) -> u32 {
        let node = self.plan.nodes.len() as u32;
        self.plan.nodes.push(Node { rule, group, reach });
        self.plan.phases[phase].push(node);
        node
    }

    /// Adds a contour that joint angles drive, its points at `angles`.
    fn ring(&mut self, section: Section, angles: &[f64], group: Group, reach: f64) -> Vec<u32> {
        self.ring_within(section, angles, group, |_| reach)
    }

    /// The same with a reach for each angle.
    fn ring_within(&mut self, section: Section, angles: &[f64], group: Group, reach: impl Fn(f64) -> f64) -> Vec<u32> {
        let index = self.plan.sections.len() as u32;
        self.plan.sections.push(section);
        let node = |&angle: &f64| self.node(0, Rule::Ring { section: index, angle }, group, reach(angle));
        angles.iter().map(node).collect()
    }

    /// Adds `count` contours between two rims.
    fn between(
        &mut self,
        phase: usize,
        rims: (&[u32], &[u32]),
        count: usize,
        link: (Place, Place),
        group: Group,
    ) -> Vec<Vec<u32>> {
        let share = |i: usize| i as f64 / (count + 1) as f64;
        let mut contour = |i: usize| -> Vec<u32> {
            let pairs = rims.0.iter().zip(rims.1);
            pairs
                .map(|(&start, &goal)| {
                    self.node(phase, Rule::Between { start, goal, share: share(i), link }, group, 0.0)
                })
                .collect()
        };
        (1..=count).map(&mut contour).collect()
    }

    /// Joins two closed contours by quadrilaterals.
    fn tube(&mut self, lower: &[u32], upper: &[u32]) {
        for k in 0..lower.len() {
            let next = (k + 1) % lower.len();
            self.plan.quads.push([lower[k], upper[k], upper[next], lower[next]]);
        }
    }

    /// Joins two open contours by quadrilaterals.
    fn strip(&mut self, lower: &[u32], upper: &[u32]) {
        for k in 0..lower.len() - 1 {
            self.plan.quads.push([lower[k], upper[k], upper[k + 1], lower[k + 1]]);
        }
    }

    /// Where a node is expected at rest: on its plane at a third of its reach, or on the rim.
    fn expected(&self, node: u32) -> Point3<f64> {
        match &self.plan.nodes[node as usize].rule {
            Rule::Ring { section, angle } => {
                let section = &self.plan.sections[*section as usize];
                let plane = self.bones.plane(&section.chain, section.link, section.share);
                let (x, y) = plane.axes(&section.reference);
                plane.origin + (x * angle.cos() + y * angle.sin()) * (self.plan.nodes[node as usize].reach / 3.0)
            }
            Rule::Rim { extremity, place } => {
                let rim = self.extremities.rim(*extremity as usize, &self.extremities.skin.mesh.positions);
                crate::boundary::at(&rim, *place)
            }
            Rule::Between { start, .. } => self.expected(*start),
            Rule::Span(weights) => {
                Point3::from(weights.iter().map(|(n, w)| self.expected(*n).coords * *w).sum::<Vector3<f64>>())
            }
        }
    }

    /// Ends a tube at an extremity: contours between its last and the rim, to the last of which the rim is stitched.
    fn end(&mut self, extremity: usize, last: &[u32], link: (Place, Place), group: Group) {
        let rim = self.extremities.rim(extremity, &self.extremities.skin.mesh.positions);
        let points: Vec<Point3<f64>> = last.iter().map(|&n| self.expected(n)).collect();
        let order = crate::boundary::matched(&points, &rim);
        let turned: Vec<Point3<f64>> = order.iter().map(|&k| rim[k as usize]).collect();
        let backward = order.len() > 1 && order[1] != (order[0] + 1) % rim.len() as u32;
        let place = |(edge, share): OnContour| {
            let (a, b) = (order[edge as usize], order[(edge as usize + 1) % order.len()]);
            if backward { (b, 1.0 - share) } else { (a, share) }
        };
        let goals: Vec<u32> = crate::boundary::resample(&turned, last.len())
            .into_iter()
            .map(|on| self.node(3, Rule::Rim { extremity: extremity as u8, place: place(on) }, group, 0.0))
            .collect();
        let apart =
            points.iter().zip(&goals).map(|(p, &g)| (p - self.expected(g)).norm()).sum::<f64>() / points.len() as f64;
        let count = (apart / self.level.spacing()).round().max(1.0) as usize;
        let mut last = last.to_vec();
        for contour in self.between(2, (&last.clone(), &goals), count, link, group) {
            self.tube(&last, &contour);
            last = contour;
        }
        self.plan.ends[extremity] = last;
    }

    /// The plan with the rims' points behind all others.
    fn finished(self) -> Plan {
        let mut plan = self.plan;
        let is_rim = |n: &Node| matches!(n.rule, Rule::Rim { .. });
        let (mesh, rims): (Vec<u32>, Vec<u32>) =
            (0..plan.nodes.len() as u32).partition(|&n| !is_rim(&plan.nodes[n as usize]));
        plan.count = mesh.len();
        let order: Vec<u32> = mesh.into_iter().chain(rims).collect();
        let mut new_of_old = vec![0u32; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| new_of_old[old as usize] = new as u32);
        let moved = |n: &mut u32| *n = new_of_old[*n as usize];
        plan.nodes = order.iter().map(|&old| plan.nodes[old as usize].clone()).collect();
        for node in &mut plan.nodes {
            match &mut node.rule {
                Rule::Between { start, goal, .. } => [start, goal].into_iter().for_each(moved),
                Rule::Span(weights) => weights.iter_mut().for_each(|(n, _)| moved(n)),
                Rule::Ring { .. } | Rule::Rim { .. } => {}
            }
        }
        plan.quads.iter_mut().flatten().for_each(moved);
        plan.phases.iter_mut().flatten().for_each(moved);
        plan.ends.iter_mut().flatten().for_each(moved);
        // rims come first: others lie between them and the rest
        plan.phases.rotate_right(1);
        plan
    }
}

/// Angles of a full circle in `count` steps from `first`, counted in direction `sign`.
fn circle(count: usize, first: f64, sign: f64) -> Vec<f64> {
    (0..count).map(|k| first + sign * std::f64::consts::TAU * k as f64 / count as f64).collect()
}

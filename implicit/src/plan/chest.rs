//! Chest and back between the armpits, the arm holes and the neck.

use nalgebra::Vector3;
use toile_character::Joint;

use super::{Draft, Rule, Section, links::arm_chain, trunk::Trunk};
use crate::group::Group;

/// Farthest skin from the shoulder joint within the plane of the arm hole, metres.
const HOLE_REACH: f64 = 0.13;

/// Up to this angle from the armpit, seen from the shoulder joint, rays in the plane of the hole would run down inside the trunk, radians
/// (55°): from the armpit to the folds before and behind it the rim is driven by its ends instead.
const FOLD: f64 = 0.96;
/// Share of the chest's breadth beside an arm hole whose skin lies over the shoulder.
const BESIDE_HOLE: f64 = 0.2;
const SHOULDERS: [Group; 2] = [Group::LeftShoulder, Group::RightShoulder];

/// The rim of an arm hole.
pub(super) struct ArmHole {
    /// The point below the armpit.
    pub corner: u32,
    /// Upward over the front, then the top, which is last.
    pub front: Vec<u32>,
    /// Upward over the back, without the top.
    pub back: Vec<u32>,
}

impl Draft<'_> {
    /// The rims of both arm holes: contours in the plane that bisects collar bone and upper arm.
    pub(super) fn arm_holes(&mut self, trunk: &Trunk) -> [ArmHole; 2] {
        [0, 1].map(|side| {
            let corner = trunk.below_armpits()[side * self.level.half_trunk];
            let joint = [Joint::LeftUpperArm, Joint::RightUpperArm][side];
            let chain = arm_chain(side);
            let down = self.marks.armpits[side] - self.bones.at(crate::bones::Place::Joint(joint));
            let reference = Vector3::new(0.0, down.y, down.z);
            let rows = self.level.arm_rows();
            let sign = [-1.0, 1.0][side];
            let angle = |row: usize| std::f64::consts::PI * row as f64 / rows as f64;
            let low = (1..rows).take_while(|&row| angle(row) < FOLD).count();
            let front: Vec<f64> = (low + 1..=rows).map(|row| sign * angle(row)).collect();
            let back: Vec<f64> = (low + 1..rows).map(|row| -sign * angle(row)).collect();
            let group = [Group::LeftShoulder, Group::RightShoulder][side];
            let section = || Section { chain: chain.clone(), link: 1, share: 0.0, reference };
            let front = self.ring(section(), &front, group, HOLE_REACH);
            let back = self.ring(section(), &back, group, HOLE_REACH);
            let mut risen = |fan: &[u32]| {
                let share = |row: usize| row as f64 / (low + 1) as f64;
                let rule = |row: usize| Rule::Span(vec![(corner, 1.0 - share(row)), (fan[0], share(row))]);
                let mut column: Vec<u32> = (1..=low).map(|row| self.node(1, rule(row), group, 0.0)).collect();
                column.extend_from_slice(fan);
                column
            };
            let (front, back) = (risen(&front), risen(&back));
            ArmHole { corner, front, back }
        })
    }

    /// Chest, back and ridges of the shoulders; returns the contour where the neck begins.
    pub(super) fn chest(&mut self, trunk: &Trunk, holes: &[ArmHole; 2]) -> Vec<u32> {
        let (width, ridge) = (self.level.half_trunk, self.level.ridge());
        let neck = self.neck_base();
        let half = neck.len() / 2;
        let [left, right] = [0, 1].map(|side| {
            let top = holes[side].front[self.level.arm_rows() - 1];
            self.ridge(top, neck[side * half], ridge)
        });
        // top rows from left to right over the front, from right to left over the back
        let around = |from: &[u32], neck: Vec<u32>, to: &[u32]| -> Vec<u32> {
            from.iter().copied().chain(neck).chain(to.iter().rev().copied()).collect()
        };
        let front = around(&left, neck[..=half].to_vec(), &right);
        let back_neck: Vec<u32> = neck[half..].iter().chain(&neck[..1]).copied().collect();
        let back = around(&right, back_neck, &left);
        let base = trunk.below_armpits();
        let front_base = base[..=width].to_vec();
        let back_base: Vec<u32> = base[width..].iter().chain(&base[..1]).copied().collect();
        let rows = self.level.arm_rows();
        let column = |side: usize, is_front: bool| -> Vec<u32> {
            let hole = &holes[side];
            let rising = if is_front { &hole.front[..rows - 1] } else { &hole.back[..] };
            [&[hole.corner], rising, &[hole.front[rows - 1]]].concat()
        };
        self.panel((&front_base, &front), (&column(0, true), &column(1, true)), SHOULDERS);
        self.panel((&back_base, &back), (&column(1, false), &column(0, false)), [SHOULDERS[1], SHOULDERS[0]]);
        neck
    }

    /// Points on a shoulder's ridge from the top of the arm hole up to, but without, the side of the neck.
    fn ridge(&mut self, top: u32, neck: u32, edges: usize) -> Vec<u32> {
        let mut points = vec![top];
        for k in 1..edges {
            let share = k as f64 / edges as f64;
            let rule = Rule::Span(vec![(top, 1.0 - share), (neck, share)]);
            points.push(self.node(1, rule, Group::UpperTorso, 0.0));
        }
        points
    }

    /// Points between four rims: `low` and `high` from one side to the other, `first` and `last` upward at both sides, where
    /// they see the primitives of `sides`.
    fn panel(&mut self, (low, high): (&[u32], &[u32]), (first, last): (&[u32], &[u32]), sides: [Group; 2]) {
        let (columns, rows) = (low.len() - 1, first.len() - 1);
        let group = |u: f64| match u {
            u if u < BESIDE_HOLE => sides[0],
            u if u > 1.0 - BESIDE_HOLE => sides[1],
            _ => Group::UpperTorso,
        };
        let mut below = low.to_vec();
        for row in 1..=rows {
            let v = row as f64 / rows as f64;
            let mut contour = vec![first[row]];
            for column in 1..columns {
                let u = column as f64 / columns as f64;
                let weights = vec![
                    (low[column], 1.0 - v),
                    (high[column], v),
                    (first[row], 1.0 - u),
                    (last[row], u),
                    (low[0], -(1.0 - u) * (1.0 - v)),
                    (low[columns], -u * (1.0 - v)),
                    (high[0], -(1.0 - u) * v),
                    (high[columns], -u * v),
                ];
                contour.push(if row < rows { self.node(2, Rule::Span(weights), group(u), 0.0) } else { high[column] });
            }
            contour.push(last[row]);
            self.strip(&below, &contour);
            below = contour;
        }
    }
}

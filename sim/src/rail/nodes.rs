//! The curve as short polynomials: what makes a frame cost some tens of nanoseconds.
//!
//! Between two borders the angles are smooth, and t(s) is known exactly. A node covers a stretch so short that the
//! polynomial of degree 5 through t at the six Gauss–Legendre points is exact to rounding; its integral, of degree 6,
//! is the position. (That integral over the whole node *is* six-point Gauss quadrature, so nodes join without a gap.) A
//! straight stretch of constant grade is one node however long. The first and the last node carry the end tangents on.

use super::alignment::Angle;
use super::frame::{Cursor, RailFrame, across, pieces};
use super::joints::Joints;
use nalgebra::Vector3;

/// Longest curved node, m, and largest angle a node may turn through, rad.
const MAX_NODE_LENGTH_M: f64 = 0.25;
const MAX_NODE_TURN_RAD: f64 = 0.05;
/// Largest error of a Taylor shift of third order, m.
const MAX_SHIFT_ERROR_M: f64 = 1e-12;
/// Step below which Newton's method stops, m.
const NEWTON_TOLERANCE_M: f64 = 1e-9;
/// Largest correction of Newton's step in `track`, m: the neglected terms are a thousandth of it.
const MAX_CORRECTION_M: f64 = 5e-7;
/// Gauss–Legendre points and weights on −1…1.
const GAUSS: [(f64, f64); 6] = [
    (-0.932_469_514_203_152, 0.171_324_492_379_170_36),
    (-0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (-0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];
/// Legendre polynomials P0…P5: coefficients of 1, x, x², …
const LEGENDRE: [[f64; 6]; 6] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [-0.5, 0.0, 1.5, 0.0, 0.0, 0.0],
    [0.0, -1.5, 0.0, 2.5, 0.0, 0.0],
    [0.375, 0.0, -3.75, 0.0, 4.375, 0.0],
    [0.0, 1.875, 0.0, -8.75, 0.0, 7.875],
];

/// One stretch: p = Σ cᵢ xⁱ with x = s − mid.
#[derive(Clone, Debug)]
struct Node {
    from: f64,
    to: f64,
    mid: f64,
    /// Range of a Taylor shift of third order, m; infinite on a straight node.
    reach: f64,
    c: [Vector3<f64>; 7],
    /// Left and up of a straight node.
    across: [Vector3<f64>; 2],
}

/// Position and its first three derivatives with respect to s.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub(super) p: Vector3<f64>,
    pub(super) t: Vector3<f64>,
    pub(super) k: Vector3<f64>,
    j: Vector3<f64>,
}

impl Node {
    fn straight(from: f64, to: f64, mid: f64, p: Vector3<f64>, t: Vector3<f64>) -> Self {
        let mut c = [Vector3::zeros(); 7];
        c[0] = p;
        c[1] = t;
        Self {
            from,
            to,
            mid,
            reach: f64::INFINITY,
            c,
            across: across(&t),
        }
    }

    /// Through the tangents at the Gauss points, starting at `p`.
    fn fitted(from: f64, to: f64, p: Vector3<f64>, tangents: &[Vector3<f64>; 6]) -> Self {
        let half = 0.5 * (to - from);
        // t(x) = Σ bᵢ xⁱ on −1…1
        let mut b = [Vector3::zeros(); 6];
        for (n, legendre) in LEGENDRE.iter().enumerate() {
            let mut a = Vector3::zeros();
            for ((x, w), t) in GAUSS.iter().zip(tangents) {
                let value = legendre.iter().rev().fold(0.0, |sum, c| sum * x + c);
                a += t * (w * value * (n as f64 + 0.5));
            }
            for (b, c) in b.iter_mut().zip(legendre) {
                *b += a * *c;
            }
        }
        // p(s) = p_mid + half · Σ bᵢ xⁱ⁺¹/(i + 1), x = (s − mid)/half
        let mut c = [Vector3::zeros(); 7];
        c[0] = p;
        let mut scale = 1.0;
        let mut side = half;
        for (i, b) in b.iter().enumerate() {
            let n = (i + 1) as f64;
            c[i + 1] = b * (scale / n);
            c[0] += b * (side / n);
            scale /= half;
            side = -side;
        }
        let fourth =
            24.0 * c[4].norm() + 120.0 * half * c[5].norm() + 360.0 * half * half * c[6].norm();
        let reach = libm::pow(24.0 * MAX_SHIFT_ERROR_M / fourth.max(1e-12), 0.25).min(0.05);
        Self {
            from,
            to,
            mid: 0.5 * (from + to),
            reach,
            c,
            across: [Vector3::zeros(); 2],
        }
    }

    /// Repeated synthetic division (Horner): the Taylor coefficients at s, up to the third.
    #[inline]
    fn eval(&self, s: f64) -> Point {
        let x = s - self.mid;
        let mut b = self.c;
        if self.reach == f64::INFINITY {
            b[0] += b[1] * x;
        } else {
            for first in 0..4 {
                for i in (first..6).rev() {
                    b[i] += b[i + 1] * x;
                }
            }
        }
        Point {
            p: b[0],
            t: b[1],
            k: b[2] * 2.0,
            j: b[3] * 6.0,
        }
    }
}

/// All nodes, in order; the first begins at −∞, the last ends at +∞.
#[derive(Clone, Debug)]
pub(super) struct Nodes(Vec<Node>);

impl Nodes {
    /// Integrate the tangent from `start` over 0…length.
    pub(super) fn build(
        start: Vector3<f64>,
        heading: &Angle,
        grade: &Angle,
        joints: Option<&Joints>,
        length: f64,
    ) -> Self {
        let tangent = |s: f64| {
            let (sin_h, cos_h) = libm::sincos(heading.value(s));
            let (sin_g, cos_g) =
                libm::sincos(grade.value(s) + joints.map_or(0.0, |j| j.angle(s).0));
            Vector3::new(cos_g * cos_h, cos_g * sin_h, sin_g)
        };
        let curvature = |s: f64| {
            heading.slope(s).abs() + (grade.slope(s) + joints.map_or(0.0, |j| j.angle(s).1)).abs()
        };
        let mut p = Sum::new(start);
        let mut nodes = vec![Node::straight(
            f64::NEG_INFINITY,
            0.0,
            0.0,
            start,
            tangent(0.0),
        )];
        for stretch in borders(heading, grade, joints, length).windows(2) {
            let (from, to) = (stretch[0], stretch[1]);
            let span = to - from;
            let bend = [1e-6, 0.25, 0.5, 0.75, 1.0 - 1e-6]
                .map(|x| curvature(from + x * span))
                .into_iter()
                .fold(0.0, f64::max);
            if bend < 1e-13 {
                let t = tangent(from + 0.5 * span);
                let middle = p.total() + t * (0.5 * span);
                nodes.push(Node::straight(from, to, from + 0.5 * span, middle, t));
                p.add(t * span);
                continue;
            }
            let count = pieces(span, MAX_NODE_LENGTH_M.min(MAX_NODE_TURN_RAD / bend));
            for i in 0..count {
                let at = |i: usize| {
                    if i == count {
                        to
                    } else {
                        from + span * i as f64 / count as f64
                    }
                };
                let (a, b) = (at(i), at(i + 1));
                let half = 0.5 * (b - a);
                let tangents = GAUSS.map(|(x, _)| tangent(a + half * (1.0 + x)));
                nodes.push(Node::fitted(a, b, p.total(), &tangents));
                let step = GAUSS
                    .iter()
                    .zip(&tangents)
                    .fold(Vector3::zeros(), |sum, ((_, w), t)| sum + t * *w);
                p.add(step * half);
            }
        }
        nodes.push(Node::straight(
            length,
            f64::INFINITY,
            length,
            p.total(),
            tangent(length),
        ));
        Self(nodes)
    }

    /// Index of the node that holds s, looked for near `hint` first.
    #[inline]
    pub(super) fn find(&self, s: f64, hint: usize) -> usize {
        match self.0.get(hint) {
            Some(node) if s >= node.from && s < node.to => hint,
            _ => self.search(s, hint),
        }
    }

    fn search(&self, s: f64, hint: usize) -> usize {
        let last = self.0.len() - 1;
        let hint = hint.min(last);
        // mostly the next or the one before
        for i in [(hint + 1).min(last), hint.saturating_sub(1)] {
            if s >= self.0[i].from && s < self.0[i].to {
                return i;
            }
        }
        self.0.partition_point(|n| n.to <= s).min(last)
    }

    #[inline]
    pub(super) fn eval(&self, node: usize, s: f64) -> Point {
        self.0[node].eval(s)
    }

    /// See [`super::Rail::project`].
    pub(super) fn project(&self, p: &Vector3<f64>, cursor: &mut Cursor) -> f64 {
        let mut last = 0.0_f64;
        for _ in 0..60 {
            cursor.node = self.find(cursor.s, cursor.node);
            let at = self.eval(cursor.node, cursor.s);
            let d = p - at.p;
            // beyond the centre of curvature the derivative changes sign: still go downhill
            let mut step = d.dot(&at.t) / (1.0 - d.dot(&at.k)).max(0.25);
            if step.abs() < NEWTON_TOLERANCE_M {
                cursor.s += step; // what is left after this step is of the order of its square
                break;
            }
            if step * last < 0.0 && step.abs() > 0.5 * last.abs() {
                step *= 0.5; // to and fro across a jump of curvature
            }
            cursor.s += step;
            last = step;
        }
        cursor.node = self.find(cursor.s, cursor.node);
        cursor.s
    }

    /// See [`super::Rail::track`]: the curve is evaluated once, where the cursor was, and its Taylor polynomial gives
    /// the foot and the frame there, as long as the foot stays inside the node and within its reach.
    #[inline]
    pub(super) fn track(&self, p: &Vector3<f64>, cursor: &mut Cursor) -> RailFrame {
        cursor.node = self.find(cursor.s, cursor.node);
        let node = &self.0[cursor.node];
        let inside = |s: f64| s >= node.from && s <= node.to;
        if node.reach == f64::INFINITY {
            let (t, [l, u]) = (node.c[1], node.across);
            let x = (p - node.c[0]).dot(&t);
            let s = node.mid + x;
            if inside(s) {
                cursor.s = s;
                let (p, k) = (node.c[0] + t * x, Vector3::zeros());
                return RailFrame { s, p, t, l, u, k };
            }
        } else {
            let at = node.eval(cursor.s);
            let d = p - at.p;
            // f(ds) = (p − p(s + ds))·t(s + ds) has f′ = d·k − 1, f″ = d·j, f‴ = k·k + …, with d = p − p(s), as t·t = 1
            let slope = 1.0 - d.dot(&at.k);
            let inverse = 1.0 / slope;
            let newton = d.dot(&at.t) * inverse;
            let mend = (0.5 * d.dot(&at.j) + at.k.norm_squared() * newton / 6.0)
                * (newton * newton)
                * inverse;
            let ds = newton + mend;
            let s = cursor.s + ds;
            if slope > 0.5 && ds.abs() <= node.reach && mend.abs() <= MAX_CORRECTION_M && inside(s)
            {
                cursor.s = s;
                return RailFrame::new(
                    s,
                    at.p + (at.t + (at.k * 0.5 + at.j * (ds / 6.0)) * ds) * ds,
                    at.t + (at.k + at.j * (0.5 * ds)) * ds,
                    at.k + at.j * ds,
                );
            }
        }
        let s = self.project(p, cursor);
        let at = self.eval(cursor.node, s);
        RailFrame::new(s, at.p, at.t, at.k)
    }

    /// See [`super::Rail::nearest`].
    pub(super) fn nearest(&self, p: &Vector3<f64>) -> Cursor {
        let mut best = (f64::INFINITY, Cursor::default());
        for (node, n) in self.0.iter().enumerate() {
            let s = n.mid
                + (p - n.c[0])
                    .dot(&n.c[1])
                    .clamp(n.from - n.mid, n.to - n.mid);
            let distance = (p - n.eval(s).p).norm_squared();
            if distance < best.0 {
                let cursor = Cursor::at(s);
                best = (distance, Cursor { node, ..cursor });
            }
        }
        self.project(p, &mut best.1);
        best.1
    }

    /// Returns chainages between `from` and `to` at which a swept mesh is cut: the ends of straight nodes, every `step`
    /// on curved nodes.
    pub(super) fn cuts(&self, from: f64, to: f64, step: f64) -> Vec<f64> {
        let mut cuts = vec![from];
        for n in &self.0[self.find(from, 0)..=self.find(to, self.0.len())] {
            let (a, b) = (n.from.max(from), n.to.min(to));
            let count = if n.reach == f64::INFINITY {
                1
            } else {
                pieces(b - a, step)
            };
            for i in 1..=count {
                let s = if i == count {
                    b
                } else {
                    a + (b - a) * i as f64 / count as f64
                };
                if cuts.last().is_some_and(|last| s > last + 1e-6) {
                    cuts.push(s);
                }
            }
        }
        cuts
    }
}

/// Every chainage at which a law changes, 0 and length among them, none nearer than 1e-9 m to the next.
fn borders(heading: &Angle, grade: &Angle, joints: Option<&Joints>, length: f64) -> Vec<f64> {
    let mut all: Vec<f64> = heading
        .pieces
        .iter()
        .chain(&grade.pieces)
        .map(|p| p.to)
        .collect();
    all.extend(joints.iter().flat_map(|j| j.borders()));
    all.retain(|s| *s > 1e-9 && *s < length - 1e-9);
    all.push(0.0);
    all.push(length);
    all.sort_by(f64::total_cmp);
    all.dedup_by(|later, earlier| *later - *earlier < 1e-9);
    all
}

/// Running sum with compensation for rounding (Kahan 1965).
struct Sum {
    total: Vector3<f64>,
    lost: Vector3<f64>,
}

impl Sum {
    fn new(start: Vector3<f64>) -> Self {
        Self {
            total: start,
            lost: Vector3::zeros(),
        }
    }

    fn add(&mut self, x: Vector3<f64>) {
        let x = x - self.lost;
        let total = self.total + x;
        self.lost = (total - self.total) - x;
        self.total = total;
    }

    fn total(&self) -> Vector3<f64> {
        self.total
    }
}

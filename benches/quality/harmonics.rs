//! Integrals of spherical harmonics over spherical polygons in closed form (Wang and Ramamoorthi 2018, "Analytic
//! Spherical Harmonic Coefficients for Polygonal Area Lights").
//!
//! A band of harmonics is spanned by Legendre polynomials about `2 l + 1` axes, so that a function is kept as weights
//! of polynomials. The integral of a polynomial over a polygon is a sum over its edges, by Green's theorem and a
//! recurrence along the edge.

use core::f64::consts::{PI, TAU};

use glam::DVec3;

/// Largest degree that is supported.
pub(crate) const MAX_DEGREE: usize = 9;

/// Three functions on the sphere up to a degree, which are the coordinates of a vector.
pub(crate) struct Harmonics {
    degree: usize,
    axes: Vec<DVec3>,
    /// For each band the weights of the polynomials about the first `2 l + 1` axes.
    bands: Vec<Vec<DVec3>>,
}

impl Harmonics {
    /// Projects `radiance(ω) ω` onto harmonics, by samples of the radiance that stand for the same solid angle each.
    pub(crate) fn of_radiance(degree: usize, samples: impl Iterator<Item = (DVec3, f64)>) -> Self {
        assert!(degree <= MAX_DEGREE, "degree {degree}");
        let mut coefficients = vec![DVec3::ZERO; (degree + 1) * (degree + 1)];
        let mut count = 0.0;
        for (direction, radiance) in samples {
            count += 1.0;
            for (sum, value) in coefficients.iter_mut().zip(basis(degree, direction)) {
                *sum += direction * (radiance * value);
            }
        }
        coefficients.iter_mut().for_each(|sum| *sum *= 4.0 * PI / count);
        let axes: Vec<DVec3> = (0..2 * degree + 1).map(axis).collect();
        let bands = (0..=degree).map(|l| band(l, &axes, &coefficients[l * l..(l + 1) * (l + 1)])).collect();
        Self { degree, axes, bands }
    }

    /// Returns the function in a direction.
    pub(crate) fn at(&self, direction: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (k, axis) in self.axes.iter().enumerate() {
            let values = legendre(self.degree, axis.dot(direction));
            for (band, value) in self.bands.iter().zip(values).skip(k.div_ceil(2)) {
                sum += band[k] * value;
            }
        }
        sum
    }

    /// Returns the integral over the polygon of these unit directions, counterclockwise as seen from the origin.
    pub(crate) fn integral(&self, polygon: &[DVec3]) -> DVec3 {
        let edges: Vec<Edge> =
            (0..polygon.len()).filter_map(|i| Edge::new(polygon[i], polygon[(i + 1) % polygon.len()])).collect();
        let mut sum = self.bands[0][0] * solid_angle(polygon);
        for (k, axis) in self.axes.iter().enumerate() {
            let mut boundary = [0.0; MAX_DEGREE + 1];
            edges.iter().for_each(|edge| edge.add(*axis, self.degree, &mut boundary));
            for (l, (band, flux)) in self.bands.iter().zip(boundary).enumerate().skip(k.div_ceil(2).max(1)) {
                // The Laplacian of a polynomial of degree l is -l (l + 1) times the polynomial.
                sum -= band[k] * (flux / (l * (l + 1)) as f64);
            }
        }
        sum
    }
}

/// An arc of a great circle.
struct Edge {
    start: DVec3,
    /// Unit vector a quarter of a circle further.
    quarter: DVec3,
    /// Unit normal of the circle that points away from the polygon.
    outward: DVec3,
    length: f64,
}

impl Edge {
    fn new(start: DVec3, end: DVec3) -> Option<Self> {
        let cross = start.cross(end);
        let sine = cross.length();
        // A shorter edge adds nothing.
        if sine < 1e-12 {
            return None;
        }
        let normal = cross / sine;
        Some(Self { start, quarter: normal.cross(start), outward: -normal, length: sine.atan2(start.dot(end)) })
    }

    /// Adds the flux of the gradients of all polynomials about an axis through the edge.
    ///
    /// With t(s) = axis · ω(s) = a cos s + b sin s, let B be the integrals of P(t) along the edge and D those of P'(t).
    /// The derivative of t' P(t) by s gives
    /// `(n + 1)² B(n+1) = n² B(n-1) + (2n + 1) ((a² + b² - 1) D(n) - [t' P(n)])`,
    /// and the derivatives of the polynomials `D(n+1) = D(n-1) + (2n + 1) B(n)`.
    fn add(&self, axis: DVec3, degree: usize, boundary: &mut [f64; MAX_DEGREE + 1]) {
        let (a, b) = (axis.dot(self.start), axis.dot(self.quarter));
        let (sine, cosine) = self.length.sin_cos();
        let [first, last] = [legendre(degree, a), legendre(degree, a * cosine + b * sine)];
        let (first_slope, last_slope) = (b, b * cosine - a * sine);
        let flux = axis.dot(self.outward);
        let radius = a * a + b * b - 1.0;
        let [mut before, mut here] = [0.0, self.length];
        let [mut slope_before, mut slope] = [0.0, 0.0];
        for n in 0..degree {
            let (m, odd) = (n as f64, (2 * n + 1) as f64);
            let change = last_slope * last[n] - first_slope * first[n];
            let next = (m * m * before + odd * (radius * slope - change)) / ((m + 1.0) * (m + 1.0));
            (slope_before, slope) = (slope, slope_before + odd * here);
            (before, here) = (here, next);
            boundary[n + 1] += flux * slope;
        }
    }
}

/// Returns the solid angle of a convex spherical polygon.
fn solid_angle(polygon: &[DVec3]) -> f64 {
    let triangle = |b: DVec3, c: DVec3| {
        let a = polygon[0];
        2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    polygon.windows(2).skip(1).map(|pair| triangle(pair[0], pair[1])).sum()
}

/// Returns the Legendre polynomials of all degrees.
fn legendre(degree: usize, t: f64) -> [f64; MAX_DEGREE + 1] {
    let mut values = [1.0; MAX_DEGREE + 1];
    values[1] = t;
    for n in 1..degree {
        let m = n as f64;
        values[n + 1] = ((2.0 * m + 1.0) * t * values[n] - m * values[n - 1]) / (m + 1.0);
    }
    values
}

/// Returns an axis: well spread over a hemisphere, whatever their number (Roberts's sequence R2).
fn axis(k: usize) -> DVec3 {
    let [u, v] = [0.754_877_666_246_693, 0.569_840_290_998_053].map(|step| ((k as f64 + 0.5) * step).fract());
    let (sine, cosine) = (TAU * v).sin_cos();
    let radius = (1.0 - u * u).sqrt();
    DVec3::new(radius * cosine, radius * sine, u)
}

/// Returns orthonormal real spherical harmonics of all bands up to a degree.
fn basis(degree: usize, d: DVec3) -> Vec<f64> {
    let mut values = vec![0.0; (degree + 1) * (degree + 1)];
    // Without the factor sin^m θ, which comes with the powers of x + iy.
    let [mut re, mut im, mut diagonal] = [1.0, 0.0, 1.0];
    for m in 0..=degree {
        let [mut before, mut here] = [0.0, diagonal];
        for l in m..=degree {
            let ratio: f64 = (l - m + 1..=l + m).map(|i| i as f64).product();
            let norm = ((2 * l + 1) as f64 / (4.0 * PI * ratio)).sqrt() * if m == 0 { 1.0 } else { 2.0_f64.sqrt() };
            let center = l * l + l;
            values[center + m] = norm * here * re;
            if m > 0 {
                values[center - m] = norm * here * im;
            }
            let next = ((2 * l + 1) as f64 * d.z * here - (l + m) as f64 * before) / (l + 1 - m) as f64;
            (before, here) = (here, next);
        }
        (re, im) = (re * d.x - im * d.y, re * d.y + im * d.x);
        diagonal *= -((2 * m + 1) as f64);
    }
    values
}

/// Returns the weights of the polynomials of a band about its axes that give these coefficients.
///
/// By the addition theorem, `P(ω · axis)` has the coefficients `4π / (2l + 1) Y(axis)`.
fn band(l: usize, axes: &[DVec3], coefficients: &[DVec3]) -> Vec<DVec3> {
    let n = 2 * l + 1;
    let scale = 4.0 * PI / n as f64;
    let columns: Vec<Vec<f64>> = axes[..n].iter().map(|axis| basis(l, *axis)[l * l..].to_vec()).collect();
    let mut rows: Vec<(Vec<f64>, DVec3)> =
        (0..n).map(|m| (columns.iter().map(|column| scale * column[m]).collect(), coefficients[m])).collect();
    solve(&mut rows)
}

/// Solves linear equations by elimination with pivots.
fn solve(rows: &mut [(Vec<f64>, DVec3)]) -> Vec<DVec3> {
    let n = rows.len();
    for i in 0..n {
        let pivot = (i..n).max_by(|&a, &b| rows[a].0[i].abs().total_cmp(&rows[b].0[i].abs())).unwrap_or(i);
        rows.swap(i, pivot);
        let (row, right) = rows[i].clone();
        for (other, other_right) in &mut rows[i + 1..] {
            let factor = other[i] / row[i];
            other.iter_mut().zip(&row).for_each(|(value, above)| *value -= factor * above);
            *other_right -= right * factor;
        }
    }
    let mut solution = vec![DVec3::ZERO; n];
    for i in (0..n).rev() {
        let (row, right) = &rows[i];
        let known: DVec3 = (i + 1..n).map(|k| solution[k] * row[k]).sum();
        solution[i] = (*right - known) / row[i];
    }
    solution
}

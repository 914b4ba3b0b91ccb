//! Lights with profiles: intensities against a second table lookup, choices against exact irradiances, photons, bytes,
//! errors.

use core::f32::consts::{FRAC_PI_2, PI, TAU};

use crate::common::bytes::check_changes;
use crate::common::lights::ARITIES;
use crate::common::pcg::Pcg32;
use crate::common::statistics::{Mean, chi_square, sidak};
use fanlight::{
    LightId, LightSampler, PointLight, Profile, ProfileId, ProfileLight, Receiver, SampledLight, ShadingPoint,
};
use glam::{DVec3, Vec3};

mod sweeps;

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;

/// A profile with its arrays.
#[derive(Clone, Debug)]
struct Table {
    vertical: Vec<f32>,
    horizontal: Vec<f32>,
    intensities: Vec<f32>,
}

impl Table {
    fn profile(&self) -> Profile<'_> {
        Profile { vertical: &self.vertical, horizontal: &self.horizontal, intensities: &self.intensities }
    }

    /// Bilinear interpolation, written once more: cell by cell, without a search.
    fn intensity(&self, theta: f64, phi: f64) -> f64 {
        let (rows, columns) = (self.vertical.len(), self.horizontal.len());
        for row in 0..rows - 1 {
            let [a, b] = [row, row + 1].map(|row| f64::from(self.vertical[row]));
            if !(a..=b).contains(&theta) {
                continue;
            }
            let v = (theta - a) / (b - a);
            let value = |row: usize, column: usize| f64::from(self.intensities[row * columns + column % columns]);
            if columns == 1 {
                return value(row, 0) * (1.0 - v) + value(row + 1, 0) * v;
            }
            for column in 0..columns {
                let c = f64::from(self.horizontal[column]);
                let d = self
                    .horizontal
                    .get(column + 1)
                    .map_or_else(|| f64::from(self.horizontal[0]) + core::f64::consts::TAU, |next| f64::from(*next));
                for turn in [-1.0, 0.0, 1.0] {
                    let h = (phi + turn * core::f64::consts::TAU - c) / (d - c);
                    if (0.0..=1.0).contains(&h) {
                        let mix = |row| value(row, column) * (1.0 - h) + value(row, column + 1) * h;
                        return mix(row) * (1.0 - v) + mix(row + 1) * v;
                    }
                }
            }
        }
        0.0
    }
}

fn ascending(pcg: &mut Pcg32, count: usize, range: [f32; 2]) -> Vec<f32> {
    let step = (range[1] - range[0]) / count as f32;
    (0..count).map(|i| range[0] + step * (i as f32 + 0.1 + 0.8 * pcg.f32())).collect()
}

fn tables(pcg: &mut Pcg32) -> Vec<Table> {
    let mut tables = vec![];
    for (rows, columns, reach) in [(2, 1, PI), (9, 1, 1.2), (7, 5, 1.0), (19, 24, PI), (5, 8, FRAC_PI_2)] {
        let vertical = ascending(pcg, rows, [0.0, reach]);
        let horizontal = ascending(pcg, columns, [0.0, TAU - 0.01]);
        let intensities = (0..rows * columns).map(|_| pcg.f32() * pcg.f32()).collect();
        tables.push(Table { vertical, horizontal, intensities });
    }
    // One lit entry.
    for (rows, columns, lit) in [(10, 12, 55), (10, 12, 0), (10, 12, 119), (4, 1, 3)] {
        let vertical = (0..rows).map(|i| PI * i as f32 / (rows - 1) as f32).collect();
        let horizontal = (0..columns).map(|i| TAU * i as f32 / columns as f32).collect();
        let intensities = (0..rows * columns).map(|i| if i == lit { 5.0 } else { 0.0 }).collect();
        tables.push(Table { vertical, horizontal, intensities });
    }
    tables
}

/// A lamp and what it refers to.
struct Placed<'a> {
    table: &'a Table,
    lamp: ProfileLight,
    position: Vec3,
    frame: [DVec3; 3],
    scale: f64,
}

fn place<'a>(table: &'a Table, profile: ProfileId, pcg: &mut Pcg32) -> Placed<'a> {
    let (axis, zero, scale) = (pcg.direction(), pcg.direction(), 0.5 + pcg.f32());
    let position = 2.0 * Vec3::from_array(pcg.cube());
    let z = axis.as_dvec3().normalize();
    let x = zero.as_dvec3().reject_from(z).normalize();
    let lamp = ProfileLight::new(position, axis, profile, scale).facing(zero);
    Placed { table, lamp, position, frame: [x, z.cross(x), z], scale: scale.into() }
}

impl Placed<'_> {
    fn towards(&self, direction: DVec3) -> f64 {
        let [x, y, z] = self.frame.map(|axis| axis.dot(direction));
        self.scale * self.table.intensity(x.hypot(y).atan2(z), y.atan2(x))
    }

    fn irradiance(&self, x: &ShadingPoint) -> f64 {
        let to = self.position.as_dvec3() - x.position.as_dvec3();
        let direction = to.normalize();
        let weight = match x.receiver {
            Receiver::Surface(normal) => normal.as_dvec3().dot(direction).max(0.0),
            _ => 1.0,
        };
        weight * self.towards(-direction) / to.length_squared()
    }
}

/// Up to a node of lamps: each is chosen by exactly what it sends, and is never chosen where it sends nothing.
#[test]
fn lamps_are_chosen_by_their_intensity() {
    let (mut lit, mut dark) = (0, 0);
    for round in 0..12 {
        let mut pcg = Pcg32::new(round, 181);
        let tables = tables(&mut pcg);
        let mut builder = LightSampler::builder();
        let mut placed = vec![];
        let count = [1, 2, 9, 14][round as usize % 4];
        for i in 0..count {
            let table = &tables[(i + round as usize) % tables.len()];
            let profile = builder.add_profile(&table.profile()).expect("a valid profile");
            let lamp = place(table, profile, &mut pcg);
            builder.add_light(lamp.lamp).expect("a valid lamp");
            placed.push(lamp);
        }
        let lights = builder.build().expect("few lights");
        for i in 0..40 {
            let position = 3.0 * Vec3::from_array(pcg.cube()) - 0.5;
            let receiver = if i % 2 == 0 { Receiver::Volume } else { Receiver::Surface(pcg.direction()) };
            let (x, at) = (ShadingPoint::new(position, receiver), lights.at(&ShadingPoint::new(position, receiver)));
            let exact: Vec<f64> = placed.iter().map(|lamp| lamp.irradiance(&x)).collect();
            let total: f64 = exact.iter().sum();
            if total == 0.0 {
                assert_eq!(at.sample(pcg.cube()), None);
                continue;
            }
            for (number, exact) in exact.iter().enumerate() {
                let pmf = f64::from(at.pmf_light(LightId::from_index(number as u32)));
                // Energies have three digits.
                let expected = exact / total;
                let is_far = exact / total < 1e-3;
                assert!(is_far || (pmf / expected - 1.0).abs() < 0.02, "{x:?}: {pmf}, not {expected}");
                lit += usize::from(!is_far);
                if *exact == 0.0 {
                    dark += 1;
                    assert!(pmf < 1e-4, "{pmf}");
                }
            }
            let Some(sample) = at.sample(pcg.cube()) else { continue };
            let SampledLight::Punctual(id) = sample.light else { panic!("{sample:?}") };
            assert!((at.pmf_light(id) / sample.pdf - 1.0).abs() < 1e-5);
            let lamp = &placed[id.index() as usize];
            let own = f64::from(lamp.lamp.intensity_towards(&lamp.table.profile(), -sample.direction));
            let exact = lamp.towards(-sample.direction.as_dvec3());
            assert!((own - exact).abs() < 1e-4 * exact + 1e-5, "{own}, not {exact}");
        }
    }
    assert!(lit > 500 && dark > 100, "{lit} lit, {dark} dark");
}

/// Many lamps: samples bring the sum of what all send.
#[test]
fn many_lamps_bring_the_sum_of_all() {
    for round in 0..3 {
        let mut pcg = Pcg32::new(round, 182);
        let tables = tables(&mut pcg);
        let mut builder = LightSampler::builder().arity(ARITIES[round as usize]);
        let ids: Vec<ProfileId> =
            tables.iter().map(|table| builder.add_profile(&table.profile()).expect("a valid profile")).collect();
        let placed: Vec<Placed<'_>> = (0..300)
            .map(|i| {
                let lamp = place(&tables[i % tables.len()], ids[i % tables.len()], &mut pcg);
                builder.add_light(lamp.lamp).expect("a valid lamp");
                lamp
            })
            .collect();
        let lights = builder.build().expect("few lights");
        for _ in 0..4 {
            let x = ShadingPoint::surface(2.0 * Vec3::from_array(pcg.cube()), pcg.direction());
            let exact: f64 = placed.iter().map(|lamp| lamp.irradiance(&x)).sum();
            let (at, mut mean) = (lights.at(&x), Mean::default());
            for _ in 0..30_000 {
                mean.add(at.sample(pcg.cube()).map_or(0.0, |sample| {
                    let lamp = &placed[sample.light.id().expect("a lamp").index() as usize];
                    lamp.irradiance(&x) / f64::from(sample.pdf)
                }));
            }
            let (found, error) = (mean.mean(), mean.error());
            assert!((found - exact).abs() < 5.0 * error + 1e-4 * exact, "{found} ± {error}, not {exact}");
            assert!(error < 0.05 * exact, "{error} of {exact}");
        }
    }
}

/// Rays of light carry the power of the table, and their densities agree.
#[test]
fn photons_carry_the_power_of_the_table() {
    let mut pcg = Pcg32::new(3, 183);
    for table in tables(&mut pcg) {
        let mut builder = LightSampler::builder();
        let profile = builder.add_profile(&table.profile()).expect("a valid profile");
        let lamp = place(&table, profile, &mut pcg);
        builder.add_light(lamp.lamp).expect("a valid lamp");
        let lights = builder.build().expect("one light");
        let emission = lights.emission();
        let mut mean = Mean::default();
        for _ in 0..20_000 {
            let ray = emission.sample(core::array::from_fn(|_| pcg.f32()));
            mean.add(ray.map_or(0.0, |ray| {
                let again = emission.pdf_light(LightId::from_index(0), ray.direction);
                assert!((again / ray.pdf - 1.0).abs() < 1e-5);
                lamp.towards(ray.direction.as_dvec3()) / f64::from(ray.pdf)
            }));
        }
        let steps = 400;
        let mut exact = 0.0;
        for i in 0..steps {
            let theta = (f64::from(i) + 0.5) * core::f64::consts::PI / f64::from(steps);
            for j in 0..steps {
                let phi = (f64::from(j) + 0.5) * core::f64::consts::TAU / f64::from(steps);
                exact += theta.sin() * lamp.scale * table.intensity(theta, phi);
            }
        }
        exact *= 2.0 * (core::f64::consts::PI / f64::from(steps)).powi(2);
        let (found, error) = (mean.mean(), mean.error());
        assert!((found - exact).abs() < 5.0 * error + 3e-3 * exact, "{table:?}: {found} ± {error}, not {exact}");
        // The table's cells differ little inside, next to each other.
        assert!(error < 0.02 * exact, "{table:?}: {error}");
    }
}

/// Photons leave the cells of the table by their power, and if they are thinned by intensity over density, the quarters
/// of all cells: both as the table says, by sums in double precision. A table that is off is told apart.
#[test]
fn photons_fall_as_the_table_says() {
    let mut pcg = Pcg32::new(5, 186);
    let tables = tables(&mut pcg);
    let significance = sidak(SIGNIFICANCE, 2 * tables.len());
    let mut told_apart = 0;
    for table in &tables {
        let mut builder = LightSampler::builder();
        let profile = builder.add_profile(&table.profile()).expect("a valid profile");
        let lamp = place(table, profile, &mut pcg);
        builder.add_light(lamp.lamp).expect("a valid lamp");
        let lights = builder.build().expect("one light");
        let emission = lights.emission();
        let quarters = Quarters::new(table);
        let rays: Vec<(usize, f64)> = (0..60_000)
            .map(|_| {
                let ray = emission.sample(core::array::from_fn(|_| pcg.f32())).expect("it sends");
                let direction = ray.direction.as_dvec3();
                let [x, y, z] = lamp.frame.map(|axis| axis.dot(direction));
                let quarter = quarters.of(x.hypot(y).atan2(z), y.atan2(x));
                (quarter, lamp.towards(direction) / f64::from(ray.pdf))
            })
            .collect();
        let most = rays.iter().fold(0.0, |most: f64, (_, ratio)| most.max(*ratio));
        let powers: Vec<f64> = (0..quarters.count()).map(|quarter| quarters.power(quarter)).collect();
        let total: f64 = powers.iter().sum();
        let (mut of_cells, mut of_quarters) = (vec![0.0; powers.len() / 4], vec![0.0; powers.len()]);
        let (mut thinned, mut expected_of_cells) = (0.0, vec![0.0; powers.len() / 4]);
        for (quarter, ratio) in rays.iter().copied() {
            of_cells[quarter / 4] += 1.0;
            if f64::from(pcg.f32()) * most < ratio {
                of_quarters[quarter] += 1.0;
                thinned += 1.0;
            }
        }
        for (quarter, power) in powers.iter().enumerate() {
            expected_of_cells[quarter / 4] += power / total * rays.len() as f64;
        }
        let expected_of_quarters: Vec<f64> = powers.iter().map(|power| power / total * thinned).collect();
        for (observed, expected) in [(&of_cells, &expected_of_cells), (&of_quarters, &expected_of_quarters)] {
            let (p, dump) = chi_square(observed, expected);
            assert!(p > significance, "{table:?}: p = {p:e}\n{dump}");
        }
        assert!(thinned > 4000.0, "{table:?}: only {thinned} are left");
        // The first half of what is expected a quarter too bright.
        let mut sum = 0.0;
        let mut wrong = expected_of_quarters;
        for value in &mut wrong {
            sum += *value;
            *value *= if 2.0 * sum < thinned { 1.25 } else { 1.0 };
        }
        let all: f64 = wrong.iter().sum();
        wrong.iter_mut().for_each(|value| *value *= thinned / all);
        let (p, _) = chi_square(&of_quarters, &wrong);
        assert!(p < significance * 1e-3 || all < 1.05 * thinned, "{table:?}: p = {p:e} for a wrong table");
        told_apart += usize::from(p < significance * 1e-3);
    }
    assert!(told_apart >= 7, "only {told_apart} of {} wrong tables are told apart", tables.len());
}

/// The cells of a table, each in four parts.
struct Quarters<'a> {
    table: &'a Table,
    /// Borders of the halves of all cells, vertical and horizontal.
    borders: [Vec<f64>; 2],
}

impl<'a> Quarters<'a> {
    fn new(table: &'a Table) -> Self {
        let halves = |angles: Vec<f64>| {
            let middles = angles.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
            middles.chain(angles.last().copied()).collect()
        };
        let vertical = table.vertical.iter().map(|angle| f64::from(*angle)).collect();
        let mut horizontal: Vec<f64> = table.horizontal.iter().map(|angle| f64::from(*angle)).collect();
        horizontal.push(horizontal[0] + core::f64::consts::TAU);
        Self { table, borders: [halves(vertical), halves(horizontal)] }
    }

    fn count(&self) -> usize {
        self.borders.iter().map(|borders| borders.len() - 1).product()
    }

    /// Those of a cell follow each other.
    fn number(&self, [row, column]: [usize; 2]) -> usize {
        let columns = (self.borders[1].len() - 1) / 2;
        4 * (row / 2 * columns + column / 2) + 2 * (row % 2) + column % 2
    }

    fn place(&self, number: usize) -> [usize; 2] {
        let columns = (self.borders[1].len() - 1) / 2;
        let (cell, part) = (number / 4, number % 4);
        [2 * (cell / columns) + part / 2, 2 * (cell % columns) + part % 2]
    }

    fn of(&self, theta: f64, phi: f64) -> usize {
        let first = self.borders[1][0];
        let phi = first + (phi - first).rem_euclid(core::f64::consts::TAU);
        self.number([(0, theta), (1, phi)].map(|(axis, angle)| {
            let borders = &self.borders[axis];
            borders.partition_point(|border| *border <= angle).clamp(1, borders.len() - 1) - 1
        }))
    }

    /// Power through a part, by the midpoint rule.
    fn power(&self, number: usize) -> f64 {
        let steps = (2000 / self.count()).clamp(6, 60);
        let [row, column] = self.place(number);
        let angles = [(0, row), (1, column)].map(|(axis, i)| [self.borders[axis][i], self.borders[axis][i + 1]]);
        let at = |k: usize, i: usize| angles[k][0] + (angles[k][1] - angles[k][0]) * (i as f64 + 0.5) / steps as f64;
        let value = |i: usize, j: usize| at(0, i).sin() * self.table.intensity(at(0, i), at(1, j));
        let sum: f64 = (0..steps * steps).map(|k| value(k / steps, k % steps)).sum();
        let area: f64 = angles.iter().map(|[a, b]| b - a).product();
        sum * area / (steps * steps) as f64
    }
}

/// Photons leave everything that is lit, however dim it is beside the rest.
#[test]
fn photons_leave_dim_cells() {
    let mut builder = LightSampler::builder();
    let table = Profile { vertical: &[0.0, 1.0, 1.1, 3.0], horizontal: &[0.0], intensities: &[1e12, 1e12, 1.0, 1.0] };
    let profile = builder.add_profile(&table).expect("a valid profile");
    builder.add_light(ProfileLight::new(Vec3::ZERO, Vec3::Z, profile, 1.0)).expect("a valid lamp");
    let lights = builder.build().expect("one light");
    let emission = lights.emission();
    let dim = |direction: Vec3| direction.z.acos() > 1.1;
    let pdf = emission.pdf_light(LightId::from_index(0), Vec3::X);
    assert!(pdf > 0.0);
    let rays = (1..=64).filter_map(|k| {
        let last = 1.0 - f32::EPSILON / 2.0 * k as f32;
        emission.sample([0.3, 0.1, 0.2, last, 0.5])
    });
    let found: Vec<_> = rays.filter(|ray| dim(ray.direction)).collect();
    assert!(!found.is_empty());
    found.iter().for_each(|ray| assert!((ray.pdf / pdf - 1.0).abs() < 1e-5, "{ray:?}, and not {pdf}"));
}

/// Every changed word is refused, or harmless; lamps keep their profiles when they move.
#[test]
fn profiles_survive_bytes_and_refits() {
    let mut pcg = Pcg32::new(4, 184);
    let tables = tables(&mut pcg);
    let mut builder = LightSampler::builder();
    for table in tables.iter().take(3) {
        let profile = builder.add_profile(&table.profile()).expect("a valid profile");
        builder.add_light(place(table, profile, &mut pcg).lamp).expect("a valid lamp");
    }
    let mut lights = builder.build().expect("few lights");
    check_changes(&lights, &[1 << 15, 1 << 30, u32::MAX], Vec3::splat(0.3), &mut pcg);
    let id = LightId::from_index(1);
    lights.refit_lights(&[(id, PointLight::new(Vec3::ZERO, 1.0).into())]).expect("a valid update");
    let moved = place(&tables[1], ProfileId::from_index(1), &mut pcg);
    lights.refit_lights(&[(id, moved.lamp.into())]).expect("a valid update");
    let x = ShadingPoint::volume(Vec3::splat(-1.0));
    let sum: f32 = (0..3).map(|i| lights.at(&x).pmf_light(LightId::from_index(i))).sum();
    assert!((sum - 1.0).abs() < 1e-5 || sum == 0.0);
    let unknown = ProfileLight::new(Vec3::ZERO, Vec3::Z, ProfileId::from_index(3), 1.0);
    let error = lights.refit_lights(&[(id, unknown.into())]).expect_err("no such profile").to_string();
    assert!(error.contains("light 1") && error.contains("profile 3"), "{error}");
}

#[test]
fn bad_profiles_are_clear_errors() {
    let refuse = |vertical: &[f32], horizontal: &[f32], intensities: &[f32], part: &str| {
        let profile = Profile { vertical, horizontal, intensities };
        let error = LightSampler::builder().add_profile(&profile).expect_err("an invalid profile").to_string();
        assert!(error.contains(part), "{error} lacks {part}");
    };
    refuse(&[0.0], &[0.0], &[1.0], "vertical angles");
    refuse(&[0.0, 1.0], &[], &[], "horizontal angles");
    refuse(&[0.0, 0.0], &[0.0], &[1.0; 2], "vertical angle 1");
    refuse(&[0.0, f32::NAN], &[0.0], &[1.0; 2], "vertical angle 1");
    refuse(&[0.0, 3.2], &[0.0], &[1.0; 2], "vertical angle 1");
    refuse(&[0.0, 1.0], &[0.0, TAU], &[1.0; 4], "horizontal angle 1");
    refuse(&[0.0, 1.0], &[-1.0, 0.0], &[1.0; 4], "horizontal angle 0");
    refuse(&[0.0, 1.0], &[0.0], &[1.0; 3], "number of intensities");
    refuse(&[0.0, 1.0], &[0.0], &[1.0, -1.0], "intensity 1");
    refuse(&[0.0, 1.0], &[0.0], &[f32::INFINITY, 1.0], "intensity 0");
    let lamp = ProfileLight::new(Vec3::ZERO, Vec3::Z, ProfileId::from_index(0), 1.0);
    let error = LightSampler::builder().add_light(lamp).expect_err("no such profile").to_string();
    assert!(error.contains("light 0") && error.contains("profile 0"), "{error}");
    let profile = Profile { vertical: &[0.0, 1.0], horizontal: &[0.0], intensities: &[1.0, 1.0] };
    let mut builder = LightSampler::builder();
    let id = builder.add_profile(&profile).expect("a valid profile");
    let error = builder.add_light(ProfileLight::new(Vec3::ZERO, Vec3::ZERO, id, 1.0)).expect_err("no axis");
    assert!(error.to_string().contains("axis"));
    let error = builder.add_light(ProfileLight::new(Vec3::ZERO, Vec3::Z, id, f32::NAN)).expect_err("no scale");
    assert!(error.to_string().contains("scale"));
}

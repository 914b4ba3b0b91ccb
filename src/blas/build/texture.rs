//! The weight image that a host passes in.

use crate::error::{Error, ErrorKind};
use crate::math::floor64;
use crate::record::{Filter, Wrap};

/// The longest side of an image, in texels. *Proved*: with [`UV_LIMIT`](super::footprint::UV_LIMIT), coordinates in
/// texels stay below 2^32, which leaves a double 20 bits within a texel.
pub(crate) const MAX_TEXTURE_SIDE: usize = 1 << 15;

/// A scalar weight over texture coordinates: luminance of an emission, transmittance of a portal.
///
/// Texel `(i, j)`, at `texels[j * width + i]`, covers `u` in `[i / width, (i + 1) / width)` and `v` in
/// `[j / height, (j + 1) / height)`. Filter and wrap say how the host looks the image up, so that no place where the
/// host sees light is left without a chance of being sampled.
///
/// Texture coordinates outside of `[0, 1]` repeat the image if it wraps so. The trees over it do not grow with the
/// number of copies: a triangle takes no more than 64 kB, or half a byte a texel if that is more, besides the 256 kB
/// that all triangles of a small image share. For a weight without an image see [`Procedural`](crate::Procedural).
#[derive(Clone, Copy)]
#[must_use]
pub struct Texture<'a> {
    width: u32,
    height: u32,
    texels: &'a [f32],
    filter: Filter,
    wrap: [Wrap; 2],
}

crate::buffers::debug_counts!(Texture<'_>, texture => {
    width: texture.width,
    height: texture.height,
    filter: texture.filter,
    wrap: texture.wrap,
});

impl<'a> Texture<'a> {
    /// An image of finite texels that are not negative, with bilinear lookup that repeats along both axes.
    ///
    /// # Errors
    ///
    /// If a side is not from 1 to 32768, if there are not `width * height` texels, or if a texel is NaN, infinite or
    /// negative.
    pub fn new(width: usize, height: usize, texels: &'a [f32]) -> Result<Self, Error> {
        let what = "texture";
        if !(1..=MAX_TEXTURE_SIDE).contains(&width) || !(1..=MAX_TEXTURE_SIDE).contains(&height) {
            return Err(Error(ErrorKind::ImageSize { what, width, height, limit: MAX_TEXTURE_SIDE }));
        }
        if texels.len() != width * height {
            return Err(Error(ErrorKind::TexelCount { what, width, height, found: texels.len() }));
        }
        if let Some(at) = texels.iter().position(|t| !(t.is_finite() && *t >= 0.0)) {
            return Err(Error(ErrorKind::Texel { what, x: at % width, y: at / width, value: texels[at] }));
        }
        let wrap = [Wrap::default(); 2];
        Ok(Self { width: width as u32, height: height as u32, texels, filter: Filter::default(), wrap })
    }

    /// How the host reads between texel centers.
    pub fn filter(self, filter: Filter) -> Self {
        Self { filter, ..self }
    }

    /// How the host reads outside of `[0, 1]`, along `u` and along `v`.
    pub fn wrap(self, u: Wrap, v: Wrap) -> Self {
        Self { wrap: [u, v], ..self }
    }

    /// Width and height in texels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Number of texels.
    pub(crate) fn texels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// How the host reads between texel centers.
    pub(crate) fn filtering(&self) -> Filter {
        self.filter
    }

    /// How the host reads outside, along each axis.
    pub(crate) fn wrapping(&self) -> [Wrap; 2] {
        self.wrap
    }

    /// A texel of the image itself.
    pub(crate) fn texel(&self, x: u32, y: u32) -> f32 {
        self.texels[y as usize * self.width as usize + x as usize]
    }

    /// Successive texels of a row of the image itself.
    pub(crate) fn run(&self, x: usize, y: usize, len: usize) -> &[f32] {
        &self.texels[y * self.width as usize + x..][..len]
    }

    /// A texel of the wrapped plane.
    pub(crate) fn fetch(&self, x: i64, y: i64) -> f32 {
        self.texel(wrap_index(self.wrap[0], x, self.width), wrap_index(self.wrap[1], y, self.height))
    }

    /// The weight at texture coordinates, as the host sees it. Coordinates that are not finite are an arbitrary place.
    #[must_use]
    pub fn value(&self, u: f32, v: f32) -> f32 {
        let x = f64::from(u) * f64::from(self.width);
        let y = f64::from(v) * f64::from(self.height);
        self.value_at(x, y) as f32
    }

    /// The weight at texel coordinates: texel `(i, j)` covers `[i, i + 1) x [j, j + 1)`.
    pub(crate) fn value_at(&self, x: f64, y: f64) -> f64 {
        match self.filter {
            Filter::Nearest => f64::from(self.fetch(floor64(x) as i64, floor64(y) as i64)),
            Filter::Bilinear => {
                let (x, y) = (x - 0.5, y - 0.5);
                let (x0, y0) = (floor64(x), floor64(y));
                let (fx, fy) = (x - x0, y - y0);
                let (i, j) = (x0 as i64, y0 as i64);
                let at = |di, dj| f64::from(self.fetch(i.saturating_add(di), j.saturating_add(dj)));
                let row = |j| at(0, j) * (1.0 - fx) + at(1, j) * fx;
                row(0) * (1.0 - fy) + row(1) * fy
            }
        }
    }
}

/// The texel of an `n` texels long axis that an index inside or outside of it stands for.
#[inline]
pub(crate) fn wrap_index(wrap: Wrap, index: i64, n: u32) -> u32 {
    let n = i64::from(n);
    // Most are inside, and divisions are slow.
    if (0..n).contains(&index) {
        return index as u32;
    }
    let wrapped = match wrap {
        Wrap::Repeat => index.rem_euclid(n),
        Wrap::Mirror => {
            let i = index.rem_euclid(2 * n);
            i.min(2 * n - 1 - i)
        }
        Wrap::Clamp => index.clamp(0, n - 1),
    };
    wrapped as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_is_not_an_image() {
        assert!(Texture::new(0, 1, &[]).is_err());
        assert!(Texture::new(1 << 16, 1, &[0.0; 1 << 16]).is_err());
        assert!(Texture::new(2, 2, &[0.0; 3]).is_err());
        for bad in [f32::NAN, f32::INFINITY, -1e-30] {
            let error = Texture::new(2, 2, &[0.0, 0.0, 0.0, bad]).unwrap_err();
            assert!(matches!(error.0, ErrorKind::Texel { x: 1, y: 1, .. }), "{error}");
        }
    }

    #[test]
    fn wraps() {
        let along = |wrap| [-4, -3, -1, 0, 2, 3, 5, 6].map(|i| wrap_index(wrap, i, 3));
        assert_eq!(along(Wrap::Repeat), [2, 0, 2, 0, 2, 0, 2, 0]);
        assert_eq!(along(Wrap::Mirror), [2, 2, 0, 0, 2, 2, 0, 0]);
        assert_eq!(along(Wrap::Clamp), [0, 0, 0, 0, 2, 2, 2, 2]);
    }

    #[test]
    fn lookup() {
        let texels = [1.0, 3.0];
        let nearest = Texture::new(2, 1, &texels).unwrap().filter(Filter::Nearest);
        assert_eq!([nearest.value(0.49, 0.5), nearest.value(0.5, 0.5), nearest.value(1.0, 7.0)], [1.0, 3.0, 1.0]);
        let bilinear = Texture::new(2, 1, &texels).unwrap();
        assert_eq!([bilinear.value(0.25, 0.0), bilinear.value(0.5, 0.0), bilinear.value(0.0, 0.0)], [1.0, 2.0, 2.0]);
        assert_eq!(bilinear.wrap(Wrap::Clamp, Wrap::Clamp).value(0.0, 0.0), 1.0);
        // Not finite is a place, not a panic.
        for u in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38] {
            let _ = (nearest.value(u, u), bilinear.value(u, u));
        }
    }
}

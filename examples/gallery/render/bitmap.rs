//! Images on surfaces.

use glam::{Vec2, Vec4, vec2};

use super::lighting::{Filter, Wrap};

/// An image with alpha, of colors that are stored as 8 bits in sRGB. Row 0 lies at `v = 0`.
#[derive(Clone, Debug)]
pub(crate) struct Bitmap {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) bytes: Vec<[u8; 4]>,
    pub(crate) filter: Filter,
    pub(crate) wrap: [Wrap; 2],
}

impl Bitmap {
    /// An image that is read by the nearest texel, and ends with its edge.
    pub(crate) fn new(width: usize, height: usize, bytes: Vec<[u8; 4]>) -> Self {
        Self { width, height, bytes, filter: Filter::Nearest, wrap: [Wrap::Clamp; 2] }
    }

    /// Draws linear colors by the middles of texels.
    pub(crate) fn draw(width: usize, height: usize, color: impl Fn(Vec2) -> Vec4) -> Self {
        let size = vec2(width as f32, height as f32);
        let texel = |i: usize| {
            let [r, g, b, a] = color((vec2((i % width) as f32, (i / width) as f32) + 0.5) / size).to_array();
            [encode_srgb(r), encode_srgb(g), encode_srgb(b), (255.0 * a.clamp(0.0, 1.0) + 0.5) as u8]
        };
        Self::new(width, height, (0..width * height).map(texel).collect())
    }

    /// A mask: opaque but for the places that are open.
    pub(crate) fn mask(width: usize, height: usize, is_open: impl Fn(Vec2) -> bool) -> Self {
        Self::draw(width, height, |uv| Vec4::new(1.0, 1.0, 1.0, if is_open(uv) { 0.0 } else { 1.0 }))
    }

    /// Linear color and alpha at a place.
    pub(crate) fn at(&self, uv: Vec2) -> Vec4 {
        let place = uv * vec2(self.width as f32, self.height as f32);
        match self.filter {
            Filter::Nearest => self.texel(place.x.floor() as i64, place.y.floor() as i64),
            Filter::Bilinear => {
                let low = (place - 0.5).floor();
                let f = place - 0.5 - low;
                let (x, y) = (low.x as i64, low.y as i64);
                let row = |y: i64| self.texel(x, y).lerp(self.texel(x + 1, y), f.x);
                row(y).lerp(row(y + 1), f.y)
            }
        }
    }

    /// What is stored for the texel at a place, from 0 to 1.
    pub(crate) fn stored_at(&self, uv: Vec2) -> [f32; 4] {
        let index = |place: f32, size: usize| ((place * size as f32) as usize).min(size - 1);
        let texel = self.bytes[index(uv.y, self.height) * self.width + index(uv.x, self.width)];
        texel.map(|byte| f32::from(byte) / 255.0)
    }

    /// Linear color and alpha of all texels.
    pub(crate) fn texels(&self) -> impl Iterator<Item = Vec4> {
        self.bytes.iter().map(|&bytes| decode(bytes))
    }

    fn texel(&self, x: i64, y: i64) -> Vec4 {
        let (x, y) = (wrapped(self.wrap[0], x, self.width), wrapped(self.wrap[1], y, self.height));
        decode(self.bytes[y * self.width + x])
    }
}

fn wrapped(wrap: Wrap, i: i64, size: usize) -> usize {
    let size = size as i64;
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Mirror => i.rem_euclid(2 * size).min(2 * size - 1 - i.rem_euclid(2 * size)),
        Wrap::Clamp => i.clamp(0, size - 1),
    };
    i as usize
}

fn decode([r, g, b, a]: [u8; 4]) -> Vec4 {
    let [r, g, b] = [r, g, b].map(|byte| LINEAR[usize::from(byte)]);
    Vec4::new(r, g, b, f32::from(a) / 255.0)
}

/// Linear values of all bytes.
static LINEAR: std::sync::LazyLock<[f32; 256]> = std::sync::LazyLock::new(|| {
    core::array::from_fn(|byte| {
        let encoded = byte as f32 / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
});

/// The byte of a linear value; clips.
pub(crate) fn encode_srgb(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded + 0.5) as u8
}

//! Triangles of lists, strips and fans.

/// Modes of a primitive. *Format.*
pub(super) const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// What messages call a mode that holds no triangles.
pub(super) const fn mode_name(mode: u32) -> &'static str {
    match mode {
        0 => "points",
        1..=3 => "lines",
        _ => "of an unknown mode",
    }
}

/// The triangles of a primitive's corners, front sides as in the file; `None` if it holds none.
pub(super) fn triangles(mode: u32, corners: &[u32]) -> Option<Vec<[u32; 3]>> {
    let mut triangles: Vec<[u32; 3]> = match mode {
        TRIANGLES => corners.as_chunks::<3>().0.to_vec(),
        STRIP => {
            let turned = |(i, window): (usize, &[u32])| match *window {
                [a, b, c] if i % 2 == 0 => Some([a, b, c]),
                [a, b, c] => Some([a, c, b]),
                _ => None,
            };
            corners.windows(3).enumerate().filter_map(turned).collect()
        }
        FAN => {
            let (&first, rest) = corners.split_first()?;
            rest.windows(2).map(|pair| [pair[0], pair[1], first]).collect()
        }
        _ => return None,
    };
    // Strips are joined by triangles without an area.
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    Some(triangles)
}

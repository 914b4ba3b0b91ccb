//! Bright features of the image.

use super::*;

#[test]
fn a_small_sun_is_a_feature() {
    // Two texels of a uniform sky, one of them in the middle of a face of the octahedron.
    let mut image = vec![1.0; 128 * 128];
    for x in [40, 41] {
        image[30 * 128 + x] = 20_000.0;
    }
    let environment = Environment::from_equal_area(128, &image, Filter::Nearest).unwrap();
    let view = environment.as_view();
    let [feature] = view.bright_features() else { panic!("{:?}", view.bright_features()) };
    let flux = f64::from(environment.mean()) * f64::from(2.0 * TAU);
    let power = f64::from(feature.power);
    assert!(power > 0.4 * flux && power < flux, "{power} of {flux}");
    assert_eq!(view.feature_texels(0).len(), 2);
    let axis = view.feature_axis(0);
    assert!(view.feature_excess(0, axis) > 0.0 && view.feature_excess(0, -axis) == 0.0);
}

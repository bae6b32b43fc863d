//! Images that may surround a mirror, at equal texels.

use depth_image::{Camera, PinholeCamera};
use glam::{UVec2, Vec3};
use sampling::{Mirror, faces, looking};

/// Texels of all images of a candidate, about.
const TEXELS: u32 = 1 << 18;
/// Nothing nearer is seen.
const NEAR_M: f32 = 0.01;
/// The field of view of images that look one way.
const WIDE_DEG: f32 = 110.0;
/// How far the corners of a square of cameras lie from its middle, in half widths of the mirror.
const CORNER: f32 = 0.6;

/// The images of clusters, without coarser levels of colour.
pub const UNFILTERED: &str = "as in a cluster, unfiltered";

/// Sample cameras for one mirror.
pub struct Candidate {
    pub name: &'static str,
    pub cameras: Vec<Camera>,
    /// Their colours have coarser levels.
    pub mips: bool,
}

/// All candidates for a mirror, which faces `seen`; the last is that of clusters. `single_poles` has the mirror with one and with
/// two single-pole images.
pub fn candidates(mirror: &Mirror, seen: Vec3, single_poles: [&Mirror; 2]) -> Vec<Candidate> {
    let bounds = &mirror.bounds;
    let middle = bounds.center();
    let towards = (seen - middle).normalize_or(Vec3::Z);
    let right = towards.any_orthonormal_vector();
    let up = right.cross(towards);
    let half_m = 0.5 * bounds.size().min_element();
    let corner = |x: f32, y: f32| middle + (right * x + up * y) * (CORNER * half_m);
    let side_px = |images: u32| UVec2::splat(((TEXELS / images) as f32).sqrt() as u32);
    let looking = |eye: Vec3, images: u32| looking((eye, NEAR_M), towards, WIDE_DEG, side_px(images));
    let pinholes = |cameras: Vec<PinholeCamera>| cameras.into_iter().map(Camera::from).collect();
    let square = [corner(-1.0, -1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, 1.0)];
    let of = |name, cameras| Candidate { name, cameras, mips: true };
    let [one, two] = single_poles.map(in_a_cluster);
    vec![
        of("single_pole:1", one),
        of("single_pole:2", two),
        of("pinhole:1", pinholes(vec![looking(middle, 1)])),
        of("pinhole:4", pinholes(square.map(|eye| looking(eye, 4)).to_vec())),
        of("six faces", pinholes(faces(middle, NEAR_M, side_px(6)))),
        Candidate { mips: false, ..of(UNFILTERED, in_a_cluster(mirror)) },
        of("as in a cluster", in_a_cluster(mirror)),
    ]
}

/// The cameras of clusters, at [`TEXELS`].
pub fn in_a_cluster(mirror: &Mirror) -> Vec<Camera> {
    Camera::resized_together(&mirror.cameras, TEXELS as f32, 1)
}

//! Mirrors in mirrors: how errors grow from one to the next.

use depth_image::PinholeCamera;
use glam::Vec3;
use render::Lighting;
use report::{Bar, Cell, Check, Table};
use sampling::Impostors;
use scene::{Limits, MissingTextures};

use super::measure::{Hall, VIEW_PX};
use crate::failures::stand::Stand;

/// Two mirrors that face each other, and a ball between them.
pub const SCENE: &str = "mirror-pair";
const ORDERS: u32 = 4;

/// A row for each number of mirrors that a ray meets, and the growth of errors as a check.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, lighting: Lighting, impostors: Impostors) -> anyhow::Result<(Table, Check)> {
    let scene = fixtures::spec(SCENE)?.load(&Limits::default(), MissingTextures::Refuse)?;
    let hall = Hall::new(stand, &scene, (lighting, 0), &views())?;
    let (bounds, sets) = hall.surroundings(impostors)?;
    let columns =
        [("mirrors on the way", ""), ("FLIP", ""), ("FLIP without rays", ""), ("PSNR", "dB"), ("guessed", "%")];
    let mut table = Table::new("Pixels by the number of mirrors that their rays meet", &columns);
    let mut errors = Vec::new();
    for order in 1..=ORDERS {
        let Some([with, without]) = hall.order(&bounds, &sets, order)? else { break };
        errors.push(with.flip);
        let numbers = [with.flip, without.flip, with.psnr_db, with.guessed_ratio * 100.0];
        table.push([Cell::from(order as usize)].into_iter().chain(numbers.map(Cell::from)))?;
    }
    let growth = errors.windows(2).map(|pair| pair[1] / pair[0]).fold(f64::NAN, f64::max);
    Ok((table, Check::new("error for each further mirror, most", growth, "×", Bar::AtMost(1.4))))
}

/// Views from between the mirrors.
pub fn views() -> [PinholeCamera; 3] {
    [-0.3f32, 0.1, 0.4].map(|z_m| between(Vec3::new(1.2, 1.5, 2.2 + z_m)))
}

fn between(eye: Vec3) -> PinholeCamera {
    PinholeCamera::looking_at(eye, Vec3::new(-2.0, 1.2, -0.6), Vec3::Y, 0.8, VIEW_PX)
}

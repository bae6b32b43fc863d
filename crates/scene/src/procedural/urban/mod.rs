//! A few blocks of a city: large flat walls and streets, with recesses, ledges and clutter on them.

mod building;
mod street;

use glam::{Vec2, Vec3};

use super::geometry::{MeshBuilder, matt};
use super::random::Rng;
use crate::{Environment, Scene};
use street::{BLOCK_M, HALF_WIDTH_M, SEED, blocks};

/// Number of triangles of the model in the paper's table 1.
const TRIANGLES: u32 = 50_000;
/// Distance from the kerb to the buildings.
const PAVEMENT_M: f32 = 5.0;

/// Nine blocks of buildings and towers around the origin, 400 m × 400 m, with streets at y = 0: 50,000 triangles.
#[must_use]
pub fn urban() -> Scene {
    let mut builder = MeshBuilder::default();
    street::add_ground(&mut builder);
    builder.finish_part(0);
    let mut rng = Rng::new(SEED, 1);
    blocks().enumerate().for_each(|(number, corner)| add_block(&mut builder, number, corner, &mut rng));
    builder.finish_part(1);
    street::add_furniture(&mut builder, TRIANGLES);
    builder.finish_part(2);
    let scene = builder.into_scene_of("urban", vec![matt("street"), matt("houses"), matt("furniture")]);
    Scene { background: Environment::uniform(Vec3::new(0.52, 0.62, 0.76)), ..scene }
}

/// Quarters of blocks that are parks: (block, quarter).
const PARKS: [(usize, u32); 5] = [(1, 3), (4, 1), (4, 3), (6, 1), (8, 0)];

/// A place on the plan, at a height.
fn at_height(on_plan: Vec2, y_m: f32) -> Vec3 {
    Vec3::new(on_plan.x, y_m, on_plan.y)
}

fn add_block(builder: &mut MeshBuilder, number: usize, corner: Vec2, rng: &mut Rng) {
    street::add_pavement(builder, corner);
    let quarter_m = (BLOCK_M - 2.0 * PAVEMENT_M) * 0.5;
    for quarter in 0..4 {
        let offset = Vec2::new((quarter % 2) as f32, (quarter / 2) as f32) * quarter_m + PAVEMENT_M;
        let middle = corner + offset + quarter_m * 0.5;
        if PARKS.contains(&(number, quarter)) {
            street::add_park(builder, middle, quarter_m * 0.5 - 2.0, rng);
        } else {
            // Tower blocks stand in the middle of the city.
            let is_central = middle.length() < 0.55 * HALF_WIDTH_M;
            building::add(builder, middle, quarter_m * 0.5, is_central, rng);
        }
    }
}

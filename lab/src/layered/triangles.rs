//! Views of small and of large scenes: a walk depends on samples, not on triangles.

use render::{LayerSelection, Lighting};
use report::{Bar, Check, Table};

use super::subject::Subject;
use super::views::{self, Figures};
use crate::failures::stand::Stand;

const SCENES: [&str; 2] = ["tree-terrain-30k", "tree-terrain-2m"];
const SIDE: u32 = 512;
const VIEWS: usize = 6;
/// The bound of the time of a view of the large scene over that of the small one.
const MOST_OVER: f64 = 1.3;

/// Adds a row for each scene, and compares the times of their views.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, lighting: Lighting, seen: &mut Table) -> anyhow::Result<Check> {
    let [small, large] = SCENES.map(|name| -> anyhow::Result<Figures> {
        let subject = Subject::new(stand, name, lighting, VIEWS)?;
        let cube = subject.cube((SIDE, LayerSelection::Dominant), lighting, 1)?;
        let walk = views::of_cube(&subject, &subject.upload(&cube)?.0)?;
        seen.push(walk.row(name, &format!("layered, {SIDE}²")))?;
        Ok(walk)
    });
    let over = large?.view_s / small?.view_s;
    let name = format!("{}: a view from a cube of {SIDE}² over one of {}", SCENES[1], SCENES[0]);
    Ok(Check::new(name, over, "", Bar::AtMost(MOST_OVER)))
}

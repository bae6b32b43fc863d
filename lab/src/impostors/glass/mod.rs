//! Glass from images: where a ray leaves a body by the paper's guess (Wyman 2005) and by images of the body's inside, beside rays through
//! the scene (Rosen et al., section 6.1).

mod ball;
mod body;
mod inside;
mod pictures;

use report::Report;

use crate::failures::stand::Stand;

/// Adds the parts of refraction to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    ball::measure(stand, report)?;
    pictures::measure(stand, is_quick, report)
}

//! The comparison of written views with the same views drawn directly.

use anyhow::Context as _;
use app_core::delivery::{open, receive_requests, requests};
use app_core::print_line;
use client::Frame;
use cluster::{BudgetRequest, DIRECT, PolicyChoice, SessionRequest};
use depth_image::ViewPlanes;

use super::args::ViewArgs;
use super::file_names::FileNames;
use super::job::Job;
use crate::comparison;

/// Asks for the same views drawn directly, and writes how far the written ones are from them. One frame at a time is compared;
/// others wait at the client. A view takes 32 bytes, and its row of the table.
pub(super) async fn compare(args: &ViewArgs, job: &Job, views: u64) -> anyhow::Result<()> {
    // Depth tells where a surface is.
    let planes = ViewPlanes { inverse_depth: true, ..job.request.planes };
    let budget = BudgetRequest::default();
    let direct =
        SessionRequest { method: DIRECT.to_owned(), policy: PolicyChoice::Auto, planes, budget, ..job.request.clone() };
    let session = open(&job.client, direct).await?;
    let mut rows = Vec::with_capacity(views as usize);
    let received = async |frame: Frame| {
        let number = frame.request.frame;
        let written = args.out.join(FileNames::of(number, ViewPlanes::default()).color);
        let row = tokio::task::spawn_blocking(move || comparison::row(&frame.view, &written)).await??;
        rows.push((number as usize, row));
        Ok(())
    };
    receive_requests(&session, requests(args.frames, job.cameras.clone()), received).await?;
    let table = comparison::table(rows)?;
    print_line!("\n{}", table.to_text());
    let path = args.out.join("comparison.csv");
    std::fs::write(&path, table.to_csv()?).with_context(|| format!("cannot write {}", path.display()))
}

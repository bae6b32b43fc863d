//! Costs of operations.

use serde::{Deserialize, Serialize};

use crate::check::{InvalidField, finite_seconds};
use crate::check_seconds;

/// Quarters of a sample image's height, each with a cost of its own.
pub const ROW_PARTS: usize = 4;

/// Seconds of one operation, each alone and warm.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Costs {
    /// g_s: one finished sample image, its lighting and its encoding included.
    pub sample_image_s: f64,
    /// g_v: one finished view drawn directly.
    pub direct_view_s: f64,
    /// c: one reconstructed view, to host pixels.
    pub reconstruct_view_s: f64,
    /// d: decode and upload of one sample set on one compositor.
    pub load_set_s: f64,
    /// e: encoding of one view.
    pub encode_view_s: f64,
    /// Whether an image of a set depends on those before it. One node then samples the whole set, and several nodes sample
    /// sets in turn.
    pub in_order: bool,
    /// How g_s splits among tiles; `None`: images are not tileable.
    pub tiles: Option<TileCosts>,
}

/// How the cost of a sample image splits among its tiles.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct TileCosts {
    /// The part of g_s that every tile costs anew, in seconds: work that does not shrink with its rows.
    pub overhead_s: f64,
    /// The shares of the image's quarters in the rest, top to bottom: rows that show the sky cost less. They add up to 1.
    /// `None`: not measured, and assumed to be equal.
    pub row_shares: Option<[f64; ROW_PARTS]>,
}

impl TileCosts {
    /// `None` where a tile costs as much as the image: such an image is not tileable.
    #[must_use]
    pub fn of_image(sample_image_s: f64, overhead_s: f64, row_shares: Option<[f64; ROW_PARTS]>) -> Option<Self> {
        (overhead_s < sample_image_s).then_some(Self { overhead_s, row_shares })
    }

    /// The share of the work on rows above a height; 0 is the top of the image, 1 its bottom.
    fn share_above(&self, height: f64) -> f64 {
        let Some(shares) = self.row_shares else { return height };
        let all: f64 = shares.iter().sum();
        let rows = height * ROW_PARTS as f64;
        shares.iter().enumerate().map(|(part, share)| share * (rows - part as f64).clamp(0.0, 1.0)).sum::<f64>() / all
    }
}

impl Costs {
    /// The mean tile of an image that is cut into `tile_count`.
    #[must_use]
    pub fn sample_tile_s(&self, tile_count: usize) -> f64 {
        let overhead_s = self.tile_overhead_s();
        overhead_s + (self.sample_image_s - overhead_s) / tile_count.max(1) as f64
    }

    /// Tile number `tile` of `tile_count`, from the top.
    #[must_use]
    pub fn sample_this_tile_s(&self, tile: usize, tile_count: usize) -> f64 {
        let overhead_s = self.tile_overhead_s();
        let top = tile as f64 / tile_count as f64;
        let bottom = (tile + 1) as f64 / tile_count as f64;
        let tiles = self.tiles.unwrap_or_default();
        overhead_s + (self.sample_image_s - overhead_s) * (tiles.share_above(bottom) - tiles.share_above(top))
    }

    /// Seconds that every tile costs anew: those of the whole image where it is not tileable.
    #[must_use]
    pub fn tile_overhead_s(&self) -> f64 {
        self.tiles.map_or(self.sample_image_s, |tiles| tiles.overhead_s.min(self.sample_image_s))
    }

    /// The greater of each: what the slowest node needs.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        let sample_image_s = self.sample_image_s.max(other.sample_image_s);
        let overhead_s = self.tile_overhead_s().max(other.tile_overhead_s());
        // Shares are a property of the scene rather than of the node.
        let row_shares = [self.tiles, other.tiles].into_iter().flatten().find_map(|tiles| tiles.row_shares);
        Self {
            sample_image_s,
            direct_view_s: self.direct_view_s.max(other.direct_view_s),
            reconstruct_view_s: self.reconstruct_view_s.max(other.reconstruct_view_s),
            load_set_s: self.load_set_s.max(other.load_set_s),
            encode_view_s: self.encode_view_s.max(other.encode_view_s),
            in_order: self.in_order || other.in_order,
            tiles: TileCosts::of_image(sample_image_s, overhead_s, row_shares),
        }
    }

    /// # Errors
    /// For times that are negative or not finite, and for shares that are not from 0 to 1 or all 0.
    pub fn validate(&self) -> Result<(), InvalidField> {
        check_seconds!(self; sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s);
        let Some(tiles) = self.tiles else { return Ok(()) };
        finite_seconds(tiles.overhead_s, "sample_overhead_s")?;
        let Some(shares) = tiles.row_shares else { return Ok(()) };
        if shares.iter().all(|share| (0.0..=1.0).contains(share)) && shares.iter().any(|&share| share > 0.0) {
            return Ok(());
        }
        Err(InvalidField::out_of_range("sample_row_shares", format!("{shares:?}"), "from 0 to 1"))
    }
}

/// The time of a view of so many pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct TimedSize {
    pub pixels: f64,
    pub seconds: f64,
}

impl TimedSize {
    /// The time of a view of `pixels`: a part that every view takes, and a part for each pixel. Another size tells them apart;
    /// without one, all is for the pixels.
    #[must_use]
    pub fn at_size(self, other: Option<Self>, pixels: f64) -> f64 {
        let slope = other.map(|other| (other.seconds - self.seconds) / (other.pixels - self.pixels));
        // Timings vary: neither part is negative.
        let pixel_s = slope.unwrap_or(f64::INFINITY).clamp(0.0, self.seconds / self.pixels);
        self.seconds + pixel_s * (pixels - self.pixels)
    }
}

/// A node's own timings of one report, the mean of each operation; `None` for what it did not do.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct MeasuredCosts {
    /// g_s: one finished sample image.
    pub sample_image_s: Option<f64>,
    /// g_v: one view drawn directly.
    pub direct_view_s: Option<f64>,
    /// c: one view reconstructed.
    pub reconstruct_view_s: Option<f64>,
    /// d: one sample set decoded and uploaded.
    pub load_set_s: Option<f64>,
    /// e: one view encoded.
    pub encode_view_s: Option<f64>,
    /// Depth images to this node.
    pub transfer_bytes_per_s: Option<f64>,
    /// B: one encoded sample image.
    pub image_bytes: Option<f64>,
}

impl MeasuredCosts {
    /// # Errors
    /// For times and rates that are negative or not finite.
    pub fn validate(&self) -> Result<(), InvalidField> {
        check_seconds!(self; sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s);
        check_seconds!(self; transfer_bytes_per_s, image_bytes);
        Ok(())
    }
}

//! The exposure of sessions that leave it to the plan.

use cluster::Workload;
use depth_image::{
    Aabb, ExposureEv, PinholeCamera, SampleCamera, ToneCurve, ToneMapping, Turn, View, ViewCell, ViewPlanes,
    linear_from_srgb8,
};
use glam::{UVec2, Vec2, Vec3};

use crate::engine::{DirectWork, Engine, EngineError};

/// The picture that is measured.
const SIZE_PX: UVec2 = UVec2::splat(64);
/// The limits of what is measured, in EV.
const MOST_EV: f32 = 8.0;
/// The share of pixels that are no brighter than the target.
const PERCENTILE: f32 = 0.95;
/// The brightness of that percentile, in linear light.
const TARGET: f32 = 0.75;
/// Brightness from here on may be cut off: 8 bits tell no more.
const CUT_OFF: f32 = 0.98;
/// Brightness up to here is known too coarsely.
const COARSE: f32 = 1.0 / 64.0;
/// Steps of exposure while brightness is not known, in EV.
const DARKER_EV: f32 = -3.0;
const BRIGHTER_EV: f32 = 5.0;
/// Exposures are steps of this many to one EV.
const STEPS_PER_EV: f32 = 100.0;
/// Enough for each way through the limits, and a refinement.
const MOST_PICTURES: usize = 6;

/// Measures the exposure of a workload on the view in the middle of its first view cell, or else from outside, drawn from the scene at
/// its start. It is 0 where that view shows no surface.
pub(crate) fn auto_exposure(engine: &dyn Engine, workload: &Workload, turn: Turn) -> Result<ExposureEv, EngineError> {
    let cameras = workload.cameras_of_cell(0).and_then(|range| workload.sample_cameras.get(range));
    let cell = cameras.and_then(|cameras| ViewCell::between(&SampleCamera::references(cameras)));
    let middle = cell.map(|cell| cell.camera_at(Vec2::ZERO, SIZE_PX));
    let camera = middle.unwrap_or_else(|| view_from_outside(&workload.volume, SIZE_PX));
    exposure_of(|exposure| {
        let tone = ToneMapping { exposure, curve: ToneCurve::None };
        let planes = ViewPlanes { tone, ..ViewPlanes::WITH_DEPTH };
        let views = engine.draw_direct(&DirectWork::of(workload, vec![camera], planes), turn)?;
        Ok(views.first().and_then(brightness))
    })
}

/// The exposure at which the brightness is the target, from a few pictures.
fn exposure_of<E>(mut brightness_at: impl FnMut(ExposureEv) -> Result<Option<f32>, E>) -> Result<ExposureEv, E> {
    let mut exposure = ExposureEv::ZERO;
    for _ in 0..MOST_PICTURES {
        let Some(brightness) = brightness_at(exposure)? else { return Ok(ExposureEv::ZERO) };
        // The way to the target, in EV, or towards exposures at which it can be told.
        let step_ev = match brightness {
            cut_off if cut_off >= CUT_OFF => DARKER_EV,
            coarse if coarse <= COARSE => BRIGHTER_EV,
            known => (TARGET / known).log2(),
        };
        let next_ev = (exposure.ev() + step_ev).clamp(-MOST_EV, MOST_EV);
        let next = ExposureEv::new((next_ev * STEPS_PER_EV).round() / STEPS_PER_EV).unwrap_or_default();
        if (next.ev() - exposure.ev()).abs() < 1.5 / STEPS_PER_EV {
            break;
        }
        exposure = next;
    }
    Ok(exposure)
}

/// The view of a box from outside, slantwise from above, which depends on no viewer.
pub(crate) fn view_from_outside(volume: &Aabb, size_px: UVec2) -> PinholeCamera {
    let middle = volume.center();
    let size_m = volume.size().length();
    let eye = middle + size_m * Vec3::new(0.9, 0.7, 0.9);
    PinholeCamera::looking_at(eye, middle, Vec3::Y, 0.8, size_px)
}

/// The percentile of the surfaces' brightest channels in linear light; `None` without surfaces. Light of one colour is cut
/// off by its channel, long before its luminance says so.
fn brightness(view: &View) -> Option<f32> {
    let depths = view.inverse_depth_per_m.as_deref()?;
    let pixels = view.srgb8.chunks_exact(3).zip(depths).filter(|(_, inverse)| **inverse > 0.0);
    let mut peaks: Vec<u8> = pixels.filter_map(|(rgb, _)| rgb.iter().copied().max()).collect();
    peaks.sort_unstable();
    let place = (PERCENTILE * peaks.len().saturating_sub(1) as f32).round() as usize;
    peaks.get(place).copied().map(linear_from_srgb8)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use depth_image::srgb8_from_linear;

    use super::*;

    #[test]
    fn the_whole_box_is_in_view() {
        for max in [Vec3::splat(2.0), Vec3::new(40.0, 1.0, 3.0), Vec3::new(1.0, 90.0, 1.0)] {
            let volume = Aabb { min: -Vec3::ONE, max };
            let view = view_from_outside(&volume, UVec2::splat(64));
            let is_seen = |corner| view.project(corner).is_some_and(|at| view.contains(at.pixel));
            assert!(view.validate().is_ok() && volume.corners().into_iter().all(is_seen), "{max}");
        }
    }

    /// What 8 bits show of surfaces that send this much light.
    fn seen(light: f32, exposure: ExposureEv) -> f32 {
        linear_from_srgb8(srgb8_from_linear(light * exposure.factor()))
    }

    fn measured_ev(light: f32) -> f32 {
        let mut pictures = 0;
        let found = exposure_of::<Infallible>(|exposure| {
            pictures += 1;
            Ok(Some(seen(light, exposure)))
        });
        assert!(pictures <= MOST_PICTURES);
        found.unwrap().ev()
    }

    #[test]
    fn four_times_the_light_is_two_ev_less() {
        for light in [0.011, 0.07, 0.3, 0.75, 1.0, 2.9, 13.0] {
            let one = measured_ev(light);
            let four = measured_ev(4.0 * light);
            assert!((one - four - 2.0).abs() < 0.05, "{light}: {one} and {four}");
            assert!((one - (TARGET / light).log2()).abs() < 0.03, "{light}: {one}");
        }
    }

    #[test]
    fn the_exposure_stays_within_its_limits() {
        assert_eq!(measured_ev(1e6), -MOST_EV);
        assert_eq!(measured_ev(1e-9), MOST_EV);
        assert_eq!(measured_ev(0.0), MOST_EV);
    }

    #[test]
    fn a_view_without_surfaces_is_shown_as_it_is() {
        assert_eq!(exposure_of::<Infallible>(|_| Ok(None)).unwrap(), ExposureEv::ZERO);
        let size_px = UVec2::new(2, 1);
        let inverse_depth_per_m = Some(vec![0.0, 0.0]);
        let empty = View { size_px, srgb8: vec![200; 6], inverse_depth_per_m, provenance: None };
        assert_eq!(brightness(&empty), None);
        let half = View { srgb8: vec![9, 30, 20, 255, 255, 255], inverse_depth_per_m: Some(vec![0.5, 0.0]), ..empty };
        assert_eq!(brightness(&half), Some(linear_from_srgb8(30)), "the background does not count");
    }
}

//! All curves at a small size on the software device.

use std::time::Instant;

use engine::GpuEngine;
use gpu::DevicePreference;

use super::curve::{Curve, Measured};
use super::curves;
use super::shape::Shape;
use super::stand::Stand;

#[test]
fn all_curves_have_their_shapes_and_strict_ones_are_refused_reversed_and_flattened() {
    let engine = GpuEngine::shared(DevicePreference::Software).unwrap();
    let stand = Stand::new(&engine, true);
    let mut bad = Vec::new();
    for curve in curves::all() {
        let start = Instant::now();
        let measured = match curve.measured(&stand) {
            Ok(measured) => measured,
            Err(error) => {
                bad.push(format!("{}: {error:#}", curve.name));
                continue;
            }
        };
        println!("{}: {:.2} s\n  {:?}", curve.name, start.elapsed().as_secs_f64(), measured.x);
        for ((series, y), violation) in curve.series.iter().zip(&measured.ys).zip(curve.violations(&measured)) {
            println!("  {:<28} {y:.4?}", series.name);
            bad.extend(violation.map(|violation| format!("{}, {}: {violation}", curve.name, series.name)));
        }
        bad.extend(unrefused(curve, &measured));
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

/// Strict shapes demand a change: a flat curve has none of them.
fn is_strict(shape: &Shape) -> bool {
    match shape {
        Shape::FallsThenFlat { .. } => true,
        Shape::Monotone { least_change, .. } => *least_change > 0.0,
        Shape::Bounded { .. } | Shape::Plateau { .. } | Shape::EqualAt { .. } => false,
    }
}

/// Strict shapes that a curve's own values also have when they are reversed or flattened.
fn unrefused(curve: &Curve, measured: &Measured) -> Vec<String> {
    let mut unrefused = Vec::new();
    for (series, y) in curve.series.iter().zip(&measured.ys) {
        let flat = vec![y.iter().sum::<f64>() / y.len() as f64; y.len()];
        let reversed: Vec<f64> = y.iter().rev().copied().collect();
        for shape in series.shapes.iter().filter(|shape| is_strict(shape)) {
            let is_refused = |y: &[f64]| shape.check(&measured.x, y).is_err();
            if !(is_refused(&flat) && is_refused(&reversed)) {
                unrefused.push(format!("{}, {}: not refused when reversed or flattened", curve.name, series.name));
            }
        }
    }
    unrefused
}

#[test]
fn the_page_names_every_curve() {
    let page = include_str!("../../../docs/failures.md");
    let missing: Vec<&str> =
        curves::all().map(|curve| curve.name).filter(|name| !page.contains(&format!("**{name}**"))).collect();
    assert!(missing.is_empty() && !page.contains("**No such curve**"), "{missing:?}");
}

#[test]
fn the_list_has_enough_curves_of_strict_shape_and_each_has_a_name_of_its_own() {
    let names: std::collections::BTreeSet<&str> = curves::all().map(|curve| curve.name).collect();
    let strict =
        curves::all().filter(|curve| curve.series.iter().any(|series| series.shapes.iter().any(is_strict))).count();
    assert_eq!(names.len(), curves::all().count());
    assert!(names.len() >= 28 && strict >= 18, "{} curves, {strict} of strict shape", names.len());
    let said = curves::all().all(|curve| !curve.why.is_empty() && !curve.series.is_empty());
    assert!(said && curves::all().flat_map(|curve| curve.series).all(|series| !series.shapes.is_empty()));
}

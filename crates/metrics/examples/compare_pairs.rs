//! Writes the pairs of `tests/suite/agreement` as binary PPM files into a folder, and prints what this crate
//! makes of them. `tests/suite/agreement/reference_values.py` prints what others make of the files.
//!
//! With a second argument, compares two PPM files instead.

#[path = "../tests/suite/agreement/pairs.rs"]
mod pairs;

use std::path::Path;

use depth_image::View;
use glam::UVec2;
use metrics::{flip_map, pdiff_map, psnr_db, ssim_map};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [folder] => write_pairs(Path::new(folder)),
        [reference, test] => print_comparison(test, &read_ppm(reference)?, &read_ppm(test)?),
        _ => Err("give a folder, or two PPM files".into()),
    }
}

fn write_pairs(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    for pair in pairs::all() {
        let write = |side: &str, pixels: &[u8]| {
            let header = format!("P6\n{} {}\n255\n", pair.width, pair.height);
            std::fs::write(folder.join(format!("{}_{side}.ppm", pair.name)), [header.as_bytes(), pixels].concat())
        };
        write("reference", &pair.reference)?;
        write("test", &pair.test)?;
        let image = |pixels| View::from_srgb8(UVec2::new(pair.width as u32, pair.height as u32), pixels);
        print_comparison(pair.name, &image(pair.reference), &image(pair.test))?;
    }
    Ok(())
}

fn print_comparison(name: &str, reference: &View, test: &View) -> Result<(), Box<dyn std::error::Error>> {
    let psnr_db = psnr_db(reference, test, None)?;
    let ssim = ssim_map(reference, test)?.mean(None)?;
    let flip = flip_map(reference, test)?.mean(None)?;
    let failing_px = pdiff_map(reference, test)?.into_iter().filter(|&fails| fails).count();
    println!(
        "{name} PSNR {psnr_db:?} dB, SSIM {ssim:?}, FLIP {flip:?}, {failing_px} pixels fail the perceptual difference"
    );
    Ok(())
}

/// The header must be as this program writes it: three lines, no comments.
fn read_ppm(path: &str) -> Result<View, Box<dyn std::error::Error>> {
    let bytes = std::fs::read(path)?;
    let mut lines = bytes.splitn(4, |&byte| byte == b'\n');
    let mut line = || lines.next().ok_or("short file");
    let _magic = line()?;
    let size = line()?;
    let _maximum = line()?;
    let pixels = line()?;
    let (width, height) = std::str::from_utf8(size)?.split_once(' ').ok_or("no size")?;
    Ok(View::from_srgb8(UVec2::new(width.parse()?, height.parse()?), pixels.to_vec()))
}

"""Prints the table of mod.rs from the pairs that the example `compare_pairs` wrote.

    pip install scikit-image flip-evaluator pillow
    cargo run --release -p metrics --example compare_pairs -- FOLDER
    python reference_values.py FOLDER
"""

import sys
from pathlib import Path

import flip_evaluator
import numpy as np
from PIL import Image
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

for name in ["noise", "blur", "shift", "block", "colour", "step"]:
    reference, test = (
        np.asarray(Image.open(Path(sys.argv[1]) / f"{name}_{side}.ppm")) for side in ("reference", "test")
    )
    psnr = peak_signal_noise_ratio(reference, test)
    ssim = structural_similarity(reference, test, channel_axis=2)
    as_float = [image.astype(np.float32) / 255 for image in (reference, test)]
    flip_map, flip, _ = flip_evaluator.evaluate(*as_float, "LDR", applyMagma=False)
    at = flip_map.shape[0] // 2, flip_map.shape[1] // 3
    print(f'    Expected {{ name: "{name}", psnr_db: {psnr!r}, ssim: {ssim!r}, flip: {flip!r}, flip_at_third: {float(flip_map[at].ravel()[0])!r} }},')

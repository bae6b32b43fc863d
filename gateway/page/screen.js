// The canvas: its size in device pixels, and the pictures on it.

export class Screen {
  constructor(canvas, onResize) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.size = [0, 0];
    const observer = new ResizeObserver((entries) => {
      const entry = entries[entries.length - 1];
      const exact = entry.devicePixelContentBoxSize?.[0];
      const ratio = window.devicePixelRatio;
      const width = exact ? exact.inlineSize : entry.contentRect.width * ratio;
      const height = exact ? exact.blockSize : entry.contentRect.height * ratio;
      const size = [Math.max(1, Math.round(width)), Math.max(1, Math.round(height))];
      if (size[0] === this.size[0] && size[1] === this.size[1]) return;
      this.size = size;
      onResize();
    });
    try {
      // The device's pixels change with the monitor, too.
      observer.observe(canvas, { box: "device-pixel-content-box" });
    } catch {
      observer.observe(canvas);
    }
  }

  /** Decodes a picture without a change of its colours. */
  static decode({ header, data }) {
    const blob = new Blob(data, { type: header.media_type });
    return createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  }

  /** Shows a picture. The canvas keeps the shape of the window, whatever the shape of the picture's pixels. */
  show(bitmap, header) {
    const [width, height] = header.still ? [bitmap.width, bitmap.height] : this.size;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    const isExact = bitmap.width === width && bitmap.height === height;
    this.context.imageSmoothingEnabled = !isExact;
    this.context.imageSmoothingQuality = "high";
    this.context.drawImage(bitmap, 0, 0, width, height);
    bitmap.close();
  }

  png() {
    return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
  }
}

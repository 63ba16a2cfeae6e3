/** What is behind the people: a colour or a picture of the user's own, which this browser keeps. */

import * as THREE from "three";

export interface Backdrop {
  /** As `#rrggbb`; null: the theme's. */
  readonly color: string | null;
  /** A picture as a `data:` address; null: none. */
  readonly picture: string | null;
}

export const NONE: Backdrop = { color: null, picture: null };
const KEPT = "motionloom-backdrop";
/** Bytes of a file that is read; pixels of its longer side, and characters as it is kept. */
const [MOST_BYTES, MOST_PIXELS, MOST_KEPT] = [30e6, 1920, 2e6];

export function storedBackdrop(): Backdrop {
  try {
    const { color, picture } = JSON.parse(localStorage.getItem(KEPT) ?? "{}") as Record<string, unknown>;
    return {
      color: typeof color === "string" && /^#[0-9a-f]{6}$/.test(color) ? color : null,
      picture: typeof picture === "string" && picture.startsWith("data:image/jpeg;base64,") ? picture : null,
    };
  } catch {
    return NONE;
  }
}

/** Keep it in this browser; raises `Error` with a sentence where there is no room. */
export function storeBackdrop(backdrop: Backdrop): void {
  try {
    localStorage.setItem(KEPT, JSON.stringify(backdrop));
  } catch {
    throw new Error("this browser has no room to keep the picture; choose a smaller one, or a colour.");
  }
}

/** A picture file as it is kept: no larger than needed. Raises `Error` with a sentence for what is none. */
export async function pictureOf(file: Blob): Promise<string> {
  const size = `${(file.size / 1e6).toFixed(0)} MB`;
  if (file.size > MOST_BYTES) throw new Error(`the picture has ${size}; at most ${MOST_BYTES / 1e6} MB are read.`);
  const found = await createImageBitmap(file).catch(() => {
    throw new Error("this is no picture that a browser can show; choose a JPEG, PNG or WebP.");
  });
  const scale = Math.min(1, MOST_PIXELS / Math.max(found.width, found.height));
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [found.width, found.height].map((side) => Math.max(Math.round(side * scale), 1)) as [
    number,
    number,
  ];
  canvas.getContext("2d")!.drawImage(found, 0, 0, canvas.width, canvas.height);
  found.close();
  const written = [0.85, 0.6, 0.4].map((quality) => canvas.toDataURL("image/jpeg", quality));
  const fits = written.find((one) => one.length <= MOST_KEPT);
  if (!fits) throw new Error("the picture is too large to be kept even when it is made smaller; choose another.");
  return fits;
}

/** The picture as a texture that fills whatever it is behind. */
export async function textureOf(picture: string): Promise<THREE.Texture> {
  const image = new Image();
  image.src = picture;
  await image.decode();
  const texture = new THREE.Texture(image);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}

/** Let a picture fill a frame of another form: what is too much of it is cut on both sides. */
export function cover(texture: THREE.Texture, aspect: number): void {
  const { width, height } = texture.image as { width: number; height: number };
  const wider = width / height / aspect;
  texture.repeat.set(Math.min(1, 1 / wider), Math.min(1, wider));
  texture.offset.set((1 - texture.repeat.x) / 2, (1 - texture.repeat.y) / 2);
  texture.updateMatrix();
}

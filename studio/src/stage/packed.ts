/** Characters out of files, also of those that are packed. */

import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { DRACO_GLTF_CONFIG, DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { inside } from "./actor";

const MAGIC = 0x46546c67;
const JSON_AT = 20;
const PICTURES = "KHR_texture_basisu";

/** The file as three.js has it; an Error says in a sentence why it cannot be shown. */
export async function unpackedFile(data: ArrayBuffer, name: string): Promise<GLTF> {
  const used = extensions(data);
  const loader = new GLTFLoader(inside);
  if (used.has(PICTURES))
    throw new Error(`${name} cannot be shown: its pictures are packed (${PICTURES}); export it with PNG or JPEG ones.`);
  if (used.has("EXT_meshopt_compression") || used.has("KHR_meshopt_compression")) {
    loader.setMeshoptDecoder(MeshoptDecoder);
  }
  if (!used.has("KHR_draco_mesh_compression")) return parseFile(loader, data, name);
  const draco = new DRACOLoader().setDecoderPath(DRACO_GLTF_CONFIG);
  try {
    return await parseFile(loader.setDRACOLoader(draco), data, name);
  } finally {
    draco.dispose();
  }
}

async function parseFile(loader: GLTFLoader, data: ArrayBuffer, name: string): Promise<GLTF> {
  try {
    return await loader.parseAsync(data, "");
  } catch (error) {
    const why = String((error as Error | null)?.message ?? error).replace(/^THREE\.\w+: /, "");
    throw new Error(`${name} cannot be shown (${why.slice(0, 120)}); export it again, without compression.`);
  }
}

/** What a file says that it uses; nothing where it is no GLB. */
function extensions(data: ArrayBuffer): Set<string> {
  const view = new DataView(data);
  if (data.byteLength < JSON_AT || view.getUint32(0, true) !== MAGIC) return new Set();
  const length = Math.min(view.getUint32(12, true), data.byteLength - JSON_AT);
  try {
    const found = JSON.parse(new TextDecoder().decode(new Uint8Array(data, JSON_AT, length))) as Record<
      string,
      unknown
    >;
    return new Set([found.extensionsUsed, found.extensionsRequired].flat().map(String));
  } catch {
    return new Set();
  }
}

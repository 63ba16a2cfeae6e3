// Plays a clip of a .glb in three.js, or a .vrma on a .vrm in three-vrm, and prints where every bone is at each second
// asked for: node play.mjs FILE CLIP SECONDS... or node play.mjs AVATAR ANIMATION SECONDS...
import { readFileSync } from "node:fs";

globalThis.self = globalThis; // the loader asks for a page's names
globalThis.createImageBitmap = async () => ({ width: 1, height: 1, close() {} }); // pictures are not looked at
const { AnimationMixer, LoopOnce, Vector3 } = await import("three");
const { GLTFLoader } = await import("three/examples/jsm/loaders/GLTFLoader.js");

const [file, second, ...seconds] = process.argv.slice(2);
const loader = new GLTFLoader();
let vrm = null;
if (second.endsWith(".vrma")) {
  const { VRMLoaderPlugin } = await import("@pixiv/three-vrm");
  const { VRMAnimationLoaderPlugin } = await import("@pixiv/three-vrm-animation");
  loader.register((parser) => new VRMLoaderPlugin(parser));
  loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
}
const load = (path) => loader.parseAsync(new Uint8Array(readFileSync(path)).buffer, "");

const gltf = await load(file);
let clip;
if (second.endsWith(".vrma")) {
  const { createVRMAnimationClip } = await import("@pixiv/three-vrm-animation");
  vrm = gltf.userData.vrm;
  clip = createVRMAnimationClip((await load(second)).userData.vrmAnimations[0], vrm);
} else {
  clip = gltf.animations.find((found) => found.name === second);
}
const mixer = new AnimationMixer(gltf.scene);
const action = mixer.clipAction(clip).setLoop(LoopOnce); // a loop would show the first frame at the end
action.clampWhenFinished = true;
action.play();

const bones = seconds.map((at) => {
  action.reset();
  mixer.setTime(Number(at));
  vrm?.humanoid.update();
  gltf.scene.updateMatrixWorld(true);
  const places = {};
  gltf.scene.traverse((node) => {
    if (node.isBone) places[node.userData.name ?? node.name] = new Vector3().setFromMatrixPosition(node.matrixWorld).toArray();
  });
  return places;
});
console.log("SHOWN " + JSON.stringify({ length: clip.duration, bones }));

/**
 * Keeps the page's files for when there is no network, and adds the headers that threads need where the host does not.
 * `tools/export_tab.py` puts the names in. The weights are kept by the page itself (`worker.ts`), which knows their digest.
 */

const NAME = `motionloom-tab-${"VERSION"}`;
const KEPT = "FILES";

addEventListener("install", (event) => {
  const add = async () => (await caches.open(NAME)).addAll(["./", ...KEPT.filter((name) => name !== "prior.bin")]);
  event.waitUntil(add().then(() => skipWaiting()));
});

addEventListener("activate", (event) => {
  const tidy = async () => {
    for (const name of await caches.keys())
      if (name.startsWith("motionloom-tab-") && name !== NAME) await caches.delete(name);
    await clients.claim();
  };
  event.waitUntil(tidy());
});

addEventListener("fetch", (event) => {
  if (event.request.method !== "GET" || new URL(event.request.url).origin !== location.origin) return;
  const answer = async () => {
    const own = await caches.open(NAME);
    const found = (await own.match(event.request, { ignoreSearch: true })) ?? (await fetch(event.request));
    if (found.type === "opaqueredirect" || !found.ok) return found;
    const headers = new Headers(found.headers);
    headers.set("Cross-Origin-Opener-Policy", "same-origin");
    headers.set("Cross-Origin-Embedder-Policy", "require-corp");
    return new Response(found.body, { status: found.status, statusText: found.statusText, headers });
  };
  event.respondWith(answer());
});

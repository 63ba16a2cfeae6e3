/**
 * Keeps the page's files for when there is no network, and adds the headers that threads need where the host does not.
 * `tools/export_tab.py` puts the names in. The weights are kept by the page itself (`worker.ts`), which knows their digest.
 */

const NAME = `motionloom-tab-${"VERSION"}`;
const KEPT = "FILES";
/** What not everybody needs: kept once it was fetched. */
const LATER = KEPT.filter((name) => name.includes(".jspi"));

addEventListener("install", (event) => {
  const add = async () =>
    (await caches.open(NAME)).addAll(["./", ...KEPT.filter((name) => name !== "prior.bin" && !LATER.includes(name))]);
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
    const kept = await own.match(event.request, { ignoreSearch: true });
    const found = kept ?? (await fetch(event.request));
    if (found.type === "opaqueredirect" || !found.ok) return found;
    if (!kept && LATER.some((name) => event.request.url.endsWith(name))) await own.put(event.request, found.clone());
    const headers = new Headers(found.headers);
    headers.set("Cross-Origin-Opener-Policy", "same-origin");
    headers.set("Cross-Origin-Embedder-Policy", "require-corp");
    return new Response(found.body, { status: found.status, statusText: found.statusText, headers });
  };
  event.respondWith(answer());
});

/** What this browser keeps of each project's history, so that undo goes on behind a reload. */

import { checked } from "../project/file";
import type { Entry, History, StoredHistory } from "../project/history";
import type { Project } from "../project/model";

const NAME = "motionloom-studio";
const STORE = "histories";
/** Steps of one project, and projects, that are kept. */
const STEPS = 200;
const PROJECTS = 12;
/** Milliseconds of quiet until what was done is kept. */
const QUIET = 100;

interface Stored extends StoredHistory<Project> {
  readonly present: Project;
  readonly at: number;
}

export const EMPTY: StoredHistory<Project> = { past: [], future: [] };

/** What was kept of a project whose state is `project` now: undo goes back over what others did meanwhile, too. */
export async function remembered(id: string, project: Project): Promise<StoredHistory<Project>> {
  try {
    const found = (await done((await opened()).transaction(STORE).objectStore(STORE).get(id))) as Stored | undefined;
    if (!found) return EMPTY;
    const past = found.past.map(read);
    if (asks(checked(found.present)) === asks(project)) return { past, future: found.future.map(read) };
    return { past: [...past, { label: "what another page did", value: checked(found.present) }], future: [] };
  } catch {
    return EMPTY; // a browser that keeps nothing, or a history of another version
  }
}

/** Keep the history of whatever project is open from now on; `id` names that project. */
export function remember(history: History<Project>, id: () => string): void {
  let timer = 0;
  const keep = () => {
    clearTimeout(timer);
    const { past, future } = history.kept;
    const stored: Stored = {
      past: past.slice(-STEPS),
      future: future.slice(-STEPS),
      present: history.value,
      at: Date.now(),
    };
    void opened()
      .then((base) => write(base, id(), stored))
      .catch(() => undefined);
  };
  history.subscribe((_, { draft }) => {
    clearTimeout(timer);
    if (!draft) timer = window.setTimeout(keep, QUIET);
  });
  addEventListener("pagehide", keep);
}

async function write(base: IDBDatabase, id: string, stored: Stored): Promise<void> {
  const writing = base.transaction(STORE, "readwrite");
  writing.objectStore(STORE).put(stored, id);
  writing.commit(); // by itself, since a page that is left does not wait for more
  const store = base.transaction(STORE, "readwrite").objectStore(STORE);
  const ids = (await done(store.getAllKeys())) as string[];
  if (ids.length <= PROJECTS) return;
  const ages = await Promise.all(ids.map(async (one) => ({ one, at: ((await done(store.get(one))) as Stored).at })));
  for (const { one } of ages.sort((a, b) => b.at - a.at).slice(PROJECTS)) store.delete(one);
}

/** What a project asks, without what was drawn of it. */
function asks(project: Project): string {
  return JSON.stringify({ ...project, takes: [], kept: 0, drawn: "" });
}

function read({ label, value }: Entry<Project>): Entry<Project> {
  return { label, value: checked(value) };
}

let base: Promise<IDBDatabase> | null = null;

function opened(): Promise<IDBDatabase> {
  base ??= new Promise((resolve, reject) => {
    const asked = indexedDB.open(NAME, 1);
    asked.onupgradeneeded = () => asked.result.createObjectStore(STORE);
    asked.onsuccess = () => resolve(asked.result);
    asked.onerror = () => reject(asked.error);
  });
  return base;
}

function done<T>(asked: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    asked.onsuccess = () => resolve(asked.result);
    asked.onerror = () => reject(asked.error);
  });
}

/** Edits of the times that somebody wants to find again. */

import { type Marker, type Project, begins, clamp, length, newId, toFrame } from "./model";

export function addMarker(project: Project, time: number): Project {
  const at = clamp(toFrame(time), 0, length(project));
  if (project.markers.some((one) => one.time === at)) return project;
  return sorted(project, [...project.markers, { id: newId(), time: at, name: `Marker ${project.markers.length + 1}` }]);
}

export function changeMarker(project: Project, id: string, part: Partial<Omit<Marker, "id">>): Project {
  const old = project.markers.find((one) => one.id === id);
  if (!old) return project;
  const time = clamp(toFrame(part.time ?? old.time), 0, length(project));
  const name = part.name ?? old.name;
  if (time === old.time && name === old.name) return project;
  return sorted(
    project,
    project.markers.map((one) => (one.id === id ? { id, time, name } : one)),
  );
}

export function removeMarker(project: Project, id: string): Project {
  return { ...project, markers: project.markers.filter((one) => one.id !== id) };
}

/** The marker or seam before a time (`by` -1) or behind it (1); the beginning or the end where there is none. */
export function nextStop(project: Project, time: number, by: 1 | -1): number {
  const stops = [...begins(project.segments), ...project.markers.map((one) => one.time)].sort((a, b) => a - b);
  return by > 0
    ? (stops.find((one) => one > time + 1e-3) ?? length(project))
    : (stops.reverse().find((one) => one < time - 1e-3) ?? 0);
}

function sorted(project: Project, markers: Marker[]): Project {
  return { ...project, markers: markers.sort((a, b) => a.time - b.time) };
}

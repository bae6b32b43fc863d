// Requests of HTTP to the gateway. A refusal is an error whose message is the gateway's sentence.

/** The query of a view: { scene, camera, size, moment, quality }; a null moment or quality is left out. */
export function queryOf({ scene, camera, size, moment, quality }, more = {}) {
  const query = new URLSearchParams({
    scene, eye: camera.eye.join(","), target: camera.target.join(","), fov: camera.fov_y_deg, size: size.join("x"), ...more,
  });
  if (moment !== null) query.set("moment", moment);
  if (quality) query.set("quality", quality);
  return query;
}

/** An answer with success. */
export async function request(name, query, signal) {
  const answer = await fetch(`api/v1/${name}?${query}`, { signal, cache: "no-store" }).catch((error) => {
    throw signal?.aborted ? error : new Error("The gateway does not answer.");
  });
  if (answer.ok) return answer;
  const sentence = (await answer.text()).trim();
  throw new Error(sentence || `The gateway answers ${answer.status}.`);
}

export async function requestJson(name, query, signal) {
  return (await request(name, query, signal)).json();
}

/** Requests of which only the newest counts. */
export class Newest {
  cancel() {
    this.controller?.abort();
  }

  /** Cancels the request before, and makes `request(signal)`. Its end calls `answered` or `failed`, unless it is cancelled, too. */
  async ask(request, answered, failed) {
    this.cancel();
    const { signal } = (this.controller = new AbortController());
    try {
      const answer = await request(signal);
      if (!signal.aborted) answered(answer);
    } catch (error) {
      if (!signal.aborted) failed(error);
    }
  }
}

/**
 * The gateway's reason not to let this page in; null where it lets it in, or does not answer in time. A POST, since browsers send no
 * Origin with a GET of the page's own server, and a proxy may have changed Host: a page that is let in gets "method not allowed".
 */
export async function refusal(withinMs) {
  const options = { method: "POST", cache: "no-store", signal: AbortSignal.timeout(withinMs) };
  const answer = await fetch("api/v1/status.json", options).catch(() => null);
  return [401, 403].includes(answer?.status) ? (await answer.text()).trim() : null;
}

/** A size within limits, of the same shape. */
export function within(size, limits) {
  const share = Math.min(1, ...size.map((side, axis) => limits[axis] / side));
  return size.map((side) => Math.max(1, Math.round(side * share)));
}

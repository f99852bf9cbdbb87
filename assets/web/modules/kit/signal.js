// A change that parts of the page tell each other of, in place of calls that would go both ways.

/**
 * @template T
 * @returns {{ listen: (listener: (value: T) => void) => void, send: (value: T) => void }}
 */
export function signal() {
  /** @type {((value: T) => void)[]} */
  const listeners = [];
  return {
    listen: (listener) => {
      listeners.push(listener);
    },
    send: (value) => {
      for (const listener of listeners) listener(value);
    },
  };
}

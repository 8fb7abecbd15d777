/** Whether this browser can draw in space. */
export const hasWebGl: boolean = (() => {
  try {
    return document.createElement("canvas").getContext("webgl2") !== null;
  } catch {
    return false;
  }
})();

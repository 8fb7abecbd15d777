import type { Place } from "../../router";
export function CorrectPage({ id }: { id: string; here: Place }) { return <p class="page">{id}</p>; }

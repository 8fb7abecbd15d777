import { useState } from "preact/hooks";
import { api } from "../api/client";

/** Asks for the token that `toile serve --listen` printed. */
export function Unlock() {
  const [wrong, setWrong] = useState<string | null>(null);
  const submit = async (event: SubmitEvent) => {
    event.preventDefault();
    const token = String(new FormData(event.currentTarget as HTMLFormElement).get("token") ?? "");
    try {
      await api.login(token.trim());
      location.reload();
    } catch (e) {
      setWrong(e instanceof Error ? e.message : String(e));
    }
  };
  return (
    <form class="page narrow stack" onSubmit={submit}>
      <h1>This archive is locked</h1>
      <p>The program printed a token when it started. It is asked for once in this browser.</p>
      <label class="field">Token
        <input name="token" type="password" autocomplete="current-password" required aria-describedby="unlock-wrong" />
      </label>
      <p id="unlock-wrong" class="bad" role="alert">{wrong}</p>
      <div><button type="submit" class="main">Unlock</button></div>
    </form>
  );
}

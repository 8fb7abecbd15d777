import { render } from "preact";
import { App } from "./app";
import { keepListening } from "./api/events";
import { applyTheme } from "./state/theme";
import "./styles/base.css";
import "./styles/shell.css";
import "./styles/parts.css";
import "./styles/archive.css";
import "./styles/subject.css";
import "./styles/scan.css";
import "./styles/jobs.css";

applyTheme();
keepListening();
const root = document.getElementById("app")!;
root.replaceChildren();
render(<App />, root);

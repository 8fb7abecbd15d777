import { fileAddress } from "../../api/client";
import type { Subject } from "../../api/types";
import { Icon } from "../../ui/icons";
import { bytesText } from "../../ui/words";
import { ExportForm } from "./export";

export function FilesPanel({ subject }: { subject: Subject }) {
  return (
    <div class="controls">
      <h2>Downloads</h2>
      {subject.downloads.length === 0 && <p class="dim">There is nothing to download yet. “Process” makes the avatar.</p>}
      <ul class="downloads">
        {subject.downloads.map((download) => (
          <li key={download.file}>
            <a href={`${fileAddress(subject.id, download.file)}?download=1`} download={download.file.split("/").pop()}>
              <Icon name="download" /><span>{download.name}<span class="dim">{download.file}</span></span><span class="dim">{bytesText(download.bytes)}</span>
            </a>
          </li>
        ))}
      </ul>
      {subject.files.includes("report.html") && <p><a href={fileAddress(subject.id, "report.html")} target="_blank" rel="noopener">Open the report in a new tab</a></p>}
      {subject.files.includes("avatar.glb") && <ExportForm subject={subject} />}
      <details>
        <summary>All {subject.files.length} files of the folder</summary>
        <ul class="all-files">{subject.files.map((file) => <li key={file}><a href={fileAddress(subject.id, file)} download={file.split("/").pop()}>{file}</a></li>)}</ul>
      </details>
    </div>
  );
}

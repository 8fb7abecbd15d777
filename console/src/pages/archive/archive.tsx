import { useEffect, useMemo, useState } from "preact/hooks";
import { address, api } from "../../api/client";
import { onEvent } from "../../api/events";
import type { Archive, SubjectLine } from "../../api/types";
import { place, placeText, refine } from "../../router";
import { useStore } from "../../state/store";
import { Icon } from "../../ui/icons";
import { tell, tellError } from "../../ui/toasts";
import { VirtualList } from "../../ui/virtual";
import { countText, momentText, SUBJECT_STATES } from "../../ui/words";
import { BinDialog } from "./bin";
import { NewSubject } from "./new_subject";
import { found, sorted, type SortKey } from "./order";

const SORTS: [SortKey, string][] = [
  ["modified", "last changed"], ["name", "name"], ["date", "date of the visit"], ["state", "state"], ["warnings", "warnings"],
];
const ROW = 68;

function useArchive(): [Archive | null, string | null, () => Promise<void>] {
  const [archive, setArchive] = useState<Archive | null>(null);
  const [error, setError] = useState<string | null>(null);
  const read = async () => {
    try {
      setArchive(await api.archive());
      setError(null);
    } catch (e) {
      setError(e instanceof Error ? e.message : String(e));
    }
  };
  useEffect(() => {
    void read();
    return onEvent((event) => {
      const ended = event.job !== undefined && event.job.state !== "queued" && event.job.state !== "running";
      if (event.archive !== undefined || event.hello !== undefined || ended) void read();
    });
  }, []);
  return [archive, error, read];
}

export function ArchivePage() {
  const [archive, error, read] = useArchive();
  const query = useStore(place).query;
  const search = query.get("q") ?? "";
  const key = (query.get("sort") ?? "modified") as SortKey;
  const reversed = query.get("reversed") === "1";
  const [adding, setAdding] = useState(false);
  const [binOpen, setBinOpen] = useState(false);
  const all = archive?.subjects ?? [];
  const shown = useMemo(() => sorted(found(all, search), key, reversed), [all, search, key, reversed]);
  const remove = (subject: SubjectLine) => void removed(subject, read);
  return (
    <div class="archive">
      <div class="archive-head">
        <div class="archive-title">
          <h1>{archive?.name ?? "Archive"}</h1>
          <p class="dim" role="status">{archive === null ? "Reading the archive …" : tally(all.length, shown.length)}</p>
        </div>
        <label class="search">
          <span class="sr">Search subjects</span><Icon name="search" />
          <input type="search" placeholder="Name, date, garment, state" value={search}
            onInput={(e) => refine({ q: e.currentTarget.value })} />
        </label>
        <label class="sort">Sort by
          <select value={key} onChange={(e) => refine({ sort: e.currentTarget.value })}>
            {SORTS.map(([value, label]) => <option key={value} value={value}>{label}</option>)}
          </select>
        </label>
        <button type="button" class="plain" aria-pressed={reversed} onClick={() => refine({ reversed: reversed ? null : "1" })}>
          Reversed
        </button>
        <button type="button" class="plain" onClick={() => setBinOpen(true)}><Icon name="bin" />Bin</button>
        <button type="button" class="main" onClick={() => setAdding(true)}><Icon name="plus" />New subject</button>
      </div>
      {error !== null && <p class="bad pad" role="alert">{error}</p>}
      {archive !== null && all.length === 0 && <Empty />}
      {archive !== null && all.length > 0 && shown.length === 0 && <p class="pad dim">No subject matches “{search}”.</p>}
      {shown.length > 0 && <VirtualList label="Subjects" count={shown.length} rowHeight={ROW} keyOf={(k) => shown[k].id}
        row={(k) => <SubjectRow subject={shown[k]} onRemove={remove} />} />}
      {binOpen && <BinDialog onRestored={() => void read()} onClose={() => setBinOpen(false)} />}
      {adding && <NewSubject taken={all.map((s) => s.id)} onClose={() => setAdding(false)} />}
    </div>
  );
}

function tally(all: number, shown: number): string {
  return all === shown ? countText(all, "subject") : `${shown} of ${countText(all, "subject")}`;
}

async function removed(subject: SubjectLine, read: () => Promise<void>) {
  try {
    const { undo } = await api.removeSubject(subject.id);
    const restore = () => api.restore(undo).then(read, tellError);
    tell(`${subject.name} was moved to the bin.`, { label: "Undo", run: () => void restore() });
    await read();
  } catch (e) {
    tellError(e);
  }
}

function Empty() {
  return (
    <div class="nobody">
      <Icon name="person" />
      <p>Nobody was scanned into this archive yet.</p>
      <p class="dim">Add a subject, then scan the body and each garment over it. The virtual person lets you practise without a camera.</p>
    </div>
  );
}

function SubjectRow({ subject, onRemove }: { subject: SubjectLine; onRemove: (s: SubjectLine) => void }) {
  const worn = subject.layers.slice(1);
  return (
    <div class="subject-row">
      <a class="subject-link" href={placeText(["subjects", subject.id])}>
        <span class="thumb">
          {subject.picture === null ? <Icon name="person" /> : <img src={address(subject.picture)} alt="" loading="lazy" decoding="async" />}
        </span>
        <span class="who"><strong>{subject.name}</strong><span class="dim">{subject.id === subject.name ? subject.date : `${subject.id} · ${subject.date}`}</span></span>
        <span class="worn">{worn.length === 0 ? <span class="dim">{subject.layers.length > 0 ? "body only" : ""}</span> : worn.map((l) => <span key={l.name} class="chip">{l.name}</span>)}</span>
        <span class={`state ${subject.state}`}>{SUBJECT_STATES[subject.state] ?? subject.state}</span>
        <span class="warn">{subject.warnings > 0 && <><Icon name="warning" />{subject.warnings}<span class="sr"> warnings</span></>}</span>
        <span class="when dim">{momentText(subject.modified)}</span>
      </a>
      <button type="button" class="icon" aria-label={`Move ${subject.name} to the bin`} title="Move to the bin" onClick={() => onRemove(subject)}>
        <Icon name="bin" />
      </button>
    </div>
  );
}

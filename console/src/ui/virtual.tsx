import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";

/** Rows of which those in sight are in the document, and a few more on both sides. */
const SPARE_ROWS = 6;

/** First and last + 1 of the rows to draw. */
export function rowsInSight(scroll: number, height: number, rowHeight: number, count: number): [number, number] {
  const first = Math.max(0, Math.floor(scroll / rowHeight) - SPARE_ROWS);
  const last = Math.min(count, Math.ceil((scroll + height) / rowHeight) + SPARE_ROWS);
  return [Math.min(first, last), last];
}

interface Props {
  label: string;
  count: number;
  rowHeight: number;
  row: (index: number) => ComponentChildren;
  keyOf: (index: number) => string;
}

export function VirtualList({ label, count, rowHeight, row, keyOf }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const [sight, setSight] = useState({ scroll: 0, height: 800 });
  useEffect(() => {
    const element = box.current!;
    const look = () => setSight({ scroll: element.scrollTop, height: element.clientHeight });
    const watcher = new ResizeObserver(look);
    watcher.observe(element);
    element.addEventListener("scroll", look, { passive: true });
    look();
    return () => {
      watcher.disconnect();
      element.removeEventListener("scroll", look);
    };
  }, []);
  const [first, last] = rowsInSight(sight.scroll, sight.height, rowHeight, count);
  const shown = Array.from({ length: last - first }, (_, k) => first + k);
  return (
    <div class="virtual" ref={box}>
      <ul class="virtual-rows" aria-label={label} style={{ height: `${count * rowHeight}px` }}>
        {shown.map((index) => (
          <li key={keyOf(index)} aria-setsize={count} aria-posinset={index + 1}
            style={{ transform: `translateY(${index * rowHeight}px)`, height: `${rowHeight}px` }}>
            {row(index)}
          </li>
        ))}
      </ul>
    </div>
  );
}

/** A binary heap of numbered items, least cost first. */
export class Heap {
  private readonly costs: number[] = [];
  private readonly items: number[] = [];

  get size(): number {
    return this.items.length;
  }

  push(item: number, cost: number): void {
    let at = this.items.length;
    this.items.push(item);
    this.costs.push(cost);
    while (at > 0) {
      const above = (at - 1) >> 1;
      if (this.costs[above] <= cost) break;
      this.swap(at, above);
      at = above;
    }
  }

  /** Takes the least item; give it to a caller who looks at `size` first. */
  pop(): [item: number, cost: number] {
    const least: [number, number] = [this.items[0], this.costs[0]];
    const [item, cost] = [this.items.pop()!, this.costs.pop()!];
    if (this.items.length > 0) {
      this.items[0] = item;
      this.costs[0] = cost;
      this.sink();
    }
    return least;
  }

  private sink(): void {
    let at = 0;
    for (;;) {
      let least = at;
      for (const below of [2 * at + 1, 2 * at + 2]) {
        if (below < this.items.length && this.costs[below] < this.costs[least]) least = below;
      }
      if (least === at) return;
      this.swap(at, least);
      at = least;
    }
  }

  private swap(a: number, b: number): void {
    [this.items[a], this.items[b]] = [this.items[b], this.items[a]];
    [this.costs[a], this.costs[b]] = [this.costs[b], this.costs[a]];
  }
}

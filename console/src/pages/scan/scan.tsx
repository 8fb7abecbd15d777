export function ScanPage({ subject }: { subject: string | null }) { return <p class="page">{subject}</p>; }

//! A transfer and its memory. Whoever holds a [`Transfer`] may read and submit it; submitting takes it by value, so
//! nobody can touch the memory while the kernel writes to it; waiting gives it back.

/// How the packets of a transfer go over the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TransferKind {
    /// As the bus has room; never lost.
    Bulk,
    /// One packet a microframe, each with a result of its own; never repeated.
    Isochronous,
}

/// How a whole transfer went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TransferStatus {
    /// Not submitted yet.
    Idle,
    /// Done; packets of isochronous transfers may have failed each by itself.
    Completed,
    /// Cancelled by us.
    Cancelled,
    /// The endpoint is halted.
    Stalled,
    /// The device sent more than there was room for.
    Overflow,
    /// Any other failure; the next one may go well.
    Failed,
    /// The device is gone.
    Unplugged,
}

/// How one isochronous packet went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PacketStatus {
    /// It came; it may be empty.
    Completed,
    /// It was lost or damaged on the bus.
    Failed,
}

/// One packet's result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PacketResult {
    pub(crate) status: PacketStatus,
    pub(crate) length: usize,
}

/// Memory for one transfer from the device, and after it was in flight, what came.
#[derive(Debug)]
pub struct Transfer {
    pub(crate) endpoint: u8,
    pub(crate) kind: TransferKind,
    pub(crate) status: TransferStatus,
    pub(crate) bytes: Vec<u8>,
    /// Bytes that came (bulk).
    pub(crate) length: usize,
    /// Room of each packet.
    pub(crate) packet_size: usize,
    pub(crate) packets: Vec<PacketResult>,
}

impl Transfer {
    /// A bulk transfer of at most `size` bytes from `endpoint`.
    pub fn bulk(endpoint: u8, size: usize) -> Self {
        Self::new(endpoint, TransferKind::Bulk, size, 0)
    }

    /// An isochronous transfer of `count` packets of at most `packet_size` bytes from `endpoint`.
    pub fn isochronous(endpoint: u8, packet_size: usize, count: usize) -> Self {
        Self::new(endpoint, TransferKind::Isochronous, packet_size, count)
    }

    fn new(endpoint: u8, kind: TransferKind, packet_size: usize, count: usize) -> Self {
        let empty = PacketResult { status: PacketStatus::Failed, length: 0 };
        Self {
            endpoint,
            kind,
            status: TransferStatus::Idle,
            bytes: vec![0; packet_size * count.max(1)],
            length: 0,
            packet_size,
            packets: vec![empty; count],
        }
    }

    /// The endpoint, with its direction bit.
    pub fn endpoint(&self) -> u8 {
        self.endpoint
    }

    /// How its packets go over the bus.
    pub fn kind(&self) -> TransferKind {
        self.kind
    }

    /// How it went.
    pub fn status(&self) -> TransferStatus {
        self.status
    }

    /// The bytes that came by bulk.
    pub fn data(&self) -> &[u8] {
        &self.bytes[..self.length.min(self.bytes.len())]
    }

    /// Bytes that each isochronous packet has room for.
    pub fn packet_room(&self) -> usize {
        self.packet_size
    }

    /// The bytes that came by isochronous packets, in their order; empty slices for packets that brought nothing.
    pub fn packets(&self) -> impl ExactSizeIterator<Item = (PacketStatus, &[u8])> {
        self.packets.iter().enumerate().map(|(i, packet)| {
            let start = i * self.packet_size;
            // A length is the device's claim: it must not reach into the next packet.
            (packet.status, &self.bytes[start..start + packet.length.min(self.packet_size)])
        })
    }

    pub(crate) fn clear(&mut self) {
        self.status = TransferStatus::Idle;
        self.length = 0;
        self.packets.fill(PacketResult { status: PacketStatus::Failed, length: 0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_that_lies_stays_within_its_packet() {
        let mut transfer = Transfer::isochronous(0x82, 4, 2);
        transfer.bytes = (0..8).collect();
        transfer.packets[0] = PacketResult { status: PacketStatus::Completed, length: 4000 };
        transfer.packets[1] = PacketResult { status: PacketStatus::Completed, length: 3 };
        let packets: Vec<&[u8]> = transfer.packets().map(|(_, bytes)| bytes).collect();
        assert_eq!(packets, [&[0, 1, 2, 3][..], &[4, 5, 6]]);
        let mut bulk = Transfer::bulk(0x81, 2);
        bulk.length = 9;
        assert_eq!(bulk.data().len(), 2);
    }
}

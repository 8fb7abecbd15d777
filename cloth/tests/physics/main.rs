//! Sheets against what is known of cloth without this program: each at three resolutions and two directions of triangles.

mod air;
mod drape;
mod energy;
mod hang;
mod peirce;
mod robust;
mod sheets;
mod slope;

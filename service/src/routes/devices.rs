//! Cameras that can be chosen.

use axum::{Json, extract::State};
use serde::Serialize;
use toile_live::{FoundDevice, Listing};
use utoipa::ToSchema;

use super::blocking::blocking;
use crate::{error::Refusal, service::Service};

/// The cameras that are plugged in.
#[derive(Debug, Serialize, ToSchema)]
pub struct Devices {
    /// The virtual person first.
    pub devices: Vec<Device>,
    /// What is wrong with them, a sentence each.
    pub warnings: Vec<String>,
}

/// A camera as it can be chosen.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({ "id": "virtual", "name": "Virtual person", "kind": "virtual", "usable": true, "problem": null, "detail": "for practice" }))]
pub struct Device {
    /// What `POST /api/capture` takes.
    pub id: String,
    /// Its name for people.
    pub name: String,
    /// Its family.
    pub kind: String,
    /// It can be opened as it stands.
    pub usable: bool,
    /// Why it cannot be used.
    pub problem: Option<String>,
    /// Where it is.
    pub detail: String,
}

impl From<FoundDevice> for Device {
    fn from(found: FoundDevice) -> Self {
        let FoundDevice { id, name, kind, usable, problem, detail } = found;
        Self { id, name, kind: kind.into(), usable, problem, detail }
    }
}

/// The cameras that are plugged in, and the virtual person for practice
#[utoipa::path(get, path = "/api/devices", tag = "capture", responses((status = 200, description = "The cameras", body = Devices)))]
pub async fn devices(State(service): State<Service>) -> Result<Json<Devices>, Refusal> {
    let listing = blocking(&service, |_| Ok(Listing::now())).await?;
    let devices = listing.devices().into_iter().map(Device::from).collect();
    Ok(Json(Devices { devices, warnings: listing.warnings }))
}

//! The dressed character as files: GLB and VRM.

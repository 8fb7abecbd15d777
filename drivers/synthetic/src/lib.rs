//! A thin capture device over the synthetic scene.

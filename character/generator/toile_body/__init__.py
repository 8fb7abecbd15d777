"""Makes Toile's body model from CC0 MakeHuman data; see ../README.md."""

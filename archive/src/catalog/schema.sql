-- The catalogue of an archive. `version` below is raised with every change: a file of another version is built anew.
CREATE TABLE subjects (
    subject TEXT PRIMARY KEY,          -- path in the archive
    name TEXT, date TEXT, rig TEXT,
    takes INTEGER NOT NULL,
    standing TEXT,                     -- up-to-date, stale, unsure, withheld
    program TEXT,                      -- that made the results
    verdict TEXT,                      -- of the fit: trusted, doubtful, failed
    estimated INTEGER,                 -- 1 where the body was estimated under clothes
    seconds REAL, peak_memory_bytes INTEGER,
    retain_over TEXT,                  -- until when it was to be kept, where that is over
    stamp TEXT NOT NULL                -- of the files that this row was read from
) WITHOUT ROWID;
CREATE TABLE takes (
    subject TEXT NOT NULL, number INTEGER NOT NULL, layer TEXT NOT NULL, type TEXT, bytes INTEGER,
    PRIMARY KEY (subject, number)
) WITHOUT ROWID;
CREATE TABLE steps (
    subject TEXT NOT NULL, folder TEXT NOT NULL, step TEXT NOT NULL,
    version INTEGER, program TEXT, verdict TEXT, seconds REAL, peak_memory_bytes INTEGER, result TEXT,
    PRIMARY KEY (subject, folder, step)
) WITHOUT ROWID;
CREATE TABLE measures (
    subject TEXT NOT NULL, name TEXT NOT NULL, kind TEXT, value_m REAL, uncertainty_m REAL, seen REAL,
    PRIMARY KEY (subject, name)
) WITHOUT ROWID;
CREATE TABLE remarks (
    subject TEXT NOT NULL, folder TEXT NOT NULL, step TEXT NOT NULL, kind TEXT NOT NULL, sentence TEXT NOT NULL
);
CREATE INDEX remarks_of ON remarks (subject);
CREATE TABLE runs (
    subject TEXT NOT NULL, at TEXT NOT NULL, outcome TEXT NOT NULL, why TEXT, attempts INTEGER,
    seconds REAL, cpu_seconds REAL, peak_memory_bytes INTEGER
);
CREATE INDEX runs_of ON runs (subject);

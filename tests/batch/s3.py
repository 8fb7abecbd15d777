"""An archive in a bucket, on a server that speaks S3's protocol (PyPI's `moto`), with faults."""

import hashlib
import json
import logging
import os
import signal
import subprocess
import sys
import tempfile
import time

import boto3

import s3_server
from common import TOILE, assert_same, small_subject, toile

SUBJECTS = ["anna", "2026/ben"]
MANIFEST = "toile-manifest.json"
SECRET = "not-a-secret-but-looked-for"


class Store:
    """The bucket, as another program sees it."""

    def __init__(self, url):
        keys = {"aws_access_key_id": "trial", "aws_secret_access_key": "x", "region_name": "us-east-1"}
        self.s3 = boto3.client("s3", endpoint_url=url, **keys)
        self.s3.create_bucket(Bucket="archive")

    def keys(self):
        pages = self.s3.get_paginator("list_objects_v2").paginate(Bucket="archive")
        return [item["Key"] for page in pages for item in page.get("Contents", [])]

    def get(self, key):
        return self.s3.get_object(Bucket="archive", Key=key)["Body"].read()

    def whole(self):
        """The subjects that have a manifest; whatever it names has the length and the hash that it tells."""
        found = [subject for subject in SUBJECTS if f"people/{subject}/{MANIFEST}" in self.keys()]
        for subject in found:
            for path, sent in json.loads(self.get(f"people/{subject}/{MANIFEST}"))["results"].items():
                body = self.get(f"people/{subject}/{path}")
                assert (len(body), hashlib.sha256(body).hexdigest()) == (sent["bytes"], sent["sha256"]), (subject, path)
        return found

    def compare(self, folder, alone):
        """Every subject, fetched by another program, is what `toile process` alone makes of it."""
        assert self.whole() == SUBJECTS
        for subject in SUBJECTS:
            at = f"people/{subject}/"
            for key in (key for key in self.keys() if key.startswith(at) and not key.endswith(MANIFEST)):
                path = os.path.join(folder, subject, key[len(at):])
                os.makedirs(os.path.dirname(path), exist_ok=True)
                with open(path, "wb") as file:
                    file.write(self.get(key))
            assert_same(os.path.join(folder, subject), alone)


def main():
    logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
    url, faults = s3_server.start()
    environment = {
        **os.environ, "AWS_ENDPOINT_URL": url, "AWS_ALLOW_HTTP": "true", "AWS_ACCESS_KEY_ID": "trial",
        "AWS_SECRET_ACCESS_KEY": SECRET, "AWS_REGION": "us-east-1", "no_proxy": "*",
    }
    store = Store(url)
    with tempfile.TemporaryDirectory() as folder:
        recorded, alone = small_subject(folder)
        for subject in SUBJECTS:
            for name in ["subject.toml", "takes/00-body.mcap"]:
                store.s3.upload_file(os.path.join(recorded, name), "archive", f"people/{subject}/{name}")

        def batch(cache, *more):
            faults.on = True
            answer, code = toile("batch", "s3://archive/people", "--cache", os.path.join(folder, cache), *more, env=environment)
            faults.on = False
            assert code == 0, answer
            return answer["results"]

        assert batch("cache", "--dry-run")["due"] == len(SUBJECTS)
        killed = kill(store, faults, os.path.join(folder, "cache"), environment)
        results = batch("cache")
        assert results["sent"] + results["up_to_date"] == len(SUBJECTS), results
        store.compare(os.path.join(folder, "first"), alone)

        # Nothing is left to do, also for a machine that has no cache yet; and nothing is fetched for that.
        results = batch("other")
        assert (results["sent"], results["up_to_date"]) == (0, len(SUBJECTS)), results
        assert not os.path.exists(os.path.join(folder, "other", SUBJECTS[0]))

        # The catalogue, from the small files alone.
        faults.on = True
        words = ["catalog", "s3://archive/people", "--cache", os.path.join(folder, "book")]
        answer, code = toile(*words, "--sql", "SELECT subject, standing, bytes > 0 FROM subjects JOIN takes USING (subject)", env=environment)
        faults.on = False
        assert code == 0, answer
        rows = answer["results"]["table"]["rows"]
        assert sorted(rows) == sorted([subject, "up-to-date", 1] for subject in SUBJECTS), answer
        assert not any("takes" in at for at, _, _ in os.walk(os.path.join(folder, "book")))

        # A cache that holds one subject at a time, and results that somebody threw away or replaced.
        store.s3.delete_object(Bucket="archive", Key=f"people/{SUBJECTS[0]}/avatar.glb")
        store.s3.put_object(Bucket="archive", Key=f"people/{SUBJECTS[1]}/build/body/body.ply", Body=b"torn")
        assert batch("other", "--cache-size", "8M")["sent"] == len(SUBJECTS)
        kept = [subject for subject in SUBJECTS if os.path.exists(os.path.join(folder, "other", subject))]
        assert len(kept) == 1, f"a cache of 8 MB holds {kept}"
        store.compare(os.path.join(folder, "second"), alone)

        refused(folder, environment)
    print(f"s3: {len(SUBJECTS)} subjects, killed with {killed} of them sent, {faults.counts}: same bytes as alone")


def kill(store, faults, cache, environment):
    """Ends a batch hard as soon as the first subject's results begin to come, and looks for anything torn."""
    faults.on = True
    words = [TOILE, "batch", "s3://archive/people", "--cache", cache, "--workers", "1", "--quiet"]
    child = subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    before = faults.counts["requests"]
    while child.poll() is None and not any("/build/" in key for key in store_keys(store)):
        time.sleep(0.2)
    assert faults.counts["requests"] > before
    child.send_signal(signal.SIGKILL)
    child.wait()
    faults.on = False
    return len(store.whole())


def store_keys(store):
    try:
        return store.keys()
    except Exception:  # A fault of the server, on purpose.
        return []


def refused(folder, environment):
    """A bucket without rights, and one that is not there: one sentence, and no credentials in it or in any file."""
    for url, word in [("s3://closed/people", "does not allow it"), ("s3://nowhere/people", "no such bucket")]:
        done = subprocess.run([TOILE, "batch", url], env=environment, capture_output=True, text=True)
        assert done.returncode == 1 and word in done.stderr, done.stderr
        assert done.stderr.count("\n") == 1 and SECRET not in done.stderr + done.stdout, done.stderr
    for at, _, names in os.walk(folder):
        for name in names:
            with open(os.path.join(at, name), "rb") as file:
                assert SECRET.encode() not in file.read(), f"credentials in {at}/{name}"


if __name__ == "__main__":
    sys.exit(main())

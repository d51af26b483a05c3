"""Every method of the daemon's API, version 1.0.0. Made by generate_methods.py from `rpc.discover`; do not edit.

Each method returns the result of the daemon as a dict; its docstring lists the fields. Other fields come from a later version of the daemon.
"""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional

JsonObject = Dict[str, Any]
Call = Callable[[str, Mapping[str, object]], JsonObject]


class ClassifyMethods:
    """Methods classify.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def live(self, *, run: str) -> JsonObject:
        """Get the newest live vote of a run; each vote is also an event of the topic "vote:R-000318".

        run: id of the run, "R-000318"
        Result: run, vote: trial, fabric, exploration, repetition, slide_s, winner, probability (by label), none_of_these,
        model_bench, ends_slide; null before the first. Least role: observer.
        """
        return self._call("classify.live", {"run": run})


class DataMethods:
    """Methods data.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def certificate(self, *, run: str, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """Get the certificate of a run: devices, files and the digests that data.verify checks.

        run: id of the run, "R-000318"
        from_: index of the first attempt (default: 0)
        most: largest number of attempts, up to 1000 (default: 100)
        Result: run, bench, name, seed, software_version, recipe_sha256, rig_sha256, dataset_sha256, trials_planned, attempts,
        ended_early, devices: name, driver, identity; files: name, bytes, sha256, path; path of the whole certificate; trials:
        name, outcome, sha256, gaps; next. Least role: observer.
        """
        return self._call("data.certificate", {"run": run, "from": from_, "most": most})

    def export(self, *, run: str, format: Optional[str] = None, stream: Optional[str] = None, exploration: Optional[str] = None,
               idem: Optional[str] = None) -> JsonObject:
        """Export the complete trials of an ended or interrupted run to a file; fetch it with GET `path` over HTTP.

        run: id of the run, "R-000318"
        format: file format (default: hdf5; hdf5: data set, features-csv: table of features, samples-csv: table of the samples
            of one stream)
        stream: stream of samples-csv (taxels, wrench, stages, acceleration, sound)
        exploration: exploration of features-csv; needed if the campaign has several
        idem: idempotency key: a repeated request returns the first answer
        Result: run, format, name, bytes, sha256, path, dataset_sha256, bench, trials, trials_planned. Least role: operator.
        Changes something.
        """
        return self._call("data.export", {"run": run, "format": format, "stream": stream, "exploration": exploration, "idem": idem})

    def get(self, *, run: str) -> JsonObject:
        """List the files of an ended run; fetch their bytes with GET `path` over HTTP, with Range and the digest as ETag.

        run: id of the run, "R-000318"
        Result: run, outcome, dataset_sha256, folder, exports: name, state (current, outdated: the run was resumed since,
        discarded or missing), trials, trials_done, trials_done_now; files: name, bytes, sha256, path. Least role: observer.
        """
        return self._call("data.get", {"run": run})

    def import_(self, *, folder: str, idem: Optional[str] = None) -> JsonObject:
        """Add the campaign folder of a weft run to the catalogue as an ended run. The folder is not moved.

        folder: folder on the daemon's machine, absolute or relative to its data folder
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("data.import", {"folder": folder, "idem": idem})

    def list(self, *, from_: Optional[str] = None, most: Optional[int] = None, order: Optional[str] = None) -> JsonObject:
        """List the data sets of all runs, complete or not, in pages.

        from_: first run of the page: next of the previous page
        most: largest number of runs, up to 1000 and 1 MiB
        order: order of the runs (default: oldest; oldest, newest)
        Result: datasets: run, recipe, name, created_us, outcome (of the run), dataset_sha256 (of the present file),
        campaign_since (as run.get), handover, result (as run.get); next (null: last page). Least role: observer.
        """
        return self._call("data.list", {"from": from_, "most": most, "order": order})

    def trial(self, *, run: str, trial: str, points: Optional[int] = None) -> JsonObject:
        """Get the curves of one trial of an ended run, reduced for display: minimum and maximum at each point, null if samples
        are missing.

        run: id of the run, "R-000318"
        trial: name of the trial, from data.trials
        points: largest number of points of a curve, 10 to 5000 (default: 1200)
        Result: run, trial, bench, label, exploration, repetition, attempt, outcome, begin_s (bench time; other times are
        relative to it), phases: phase, begin_s, end_s; target: phase, force_N, band_N; force: t_s, fx_N, fy_N, fz_N (each
        min, max); stages: t_s, x_mm ... ry_deg (each min, max); taxels: mean_S_counts, mean_M_counts, t_s, counts (at most
        300 frames). Least role: observer.
        """
        return self._call("data.trial", {"run": run, "trial": trial, "points": points})

    def trials(self, *, run: str, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """List all attempts of an ended run in pages, in the order of the plan.

        run: id of the run, "R-000318"
        from_: index of the first attempt (default: 0)
        most: largest number of attempts, up to 200 (default: 50)
        Result: run, bench, trials: trial (its name), index (of the plan), attempt, label, exploration, repetition, piece,
        mounting, patch, outcome, reason (of a rejection or failure), lost_frames; force_rms_error_N, force_worst_error_N,
        force_in_band_share (while the force was regulated); rest: weight_N, before_N, after_N; next. Least role: observer.
        """
        return self._call("data.trials", {"run": run, "from": from_, "most": most})

    def verify(self, *, run: str) -> JsonObject:
        """Verify that the campaign file, data set and handover of a run match what was recorded, byte by byte.

        run: id of the run, "R-000318"
        Result: run, holds, certified, finished, blank, trials_planned, trials_complete, attempts, lost_samples,
        dataset_sha256, software_version, exports: name, state, trials, trials_done, trials_done_now; findings: where, what,
        hint. Least role: observer.
        """
        return self._call("data.verify", {"run": run})


class DeviceMethods:
    """Methods device.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def describe(self, *, device: str) -> JsonObject:
        """Describe a device: its driver, its configuration and the schema of that.

        device: name of the device, "stage.z"
        Result: device, role, driver, link, summary, bench, plugin (its file, or null), config, config_schema: JSON Schema,
        draft 2020-12, with x-unit, and x-safety for values that protect people or equipment. Least role: observer.
        """
        return self._call("device.describe", {"device": device})

    def list(self) -> JsonObject:
        """List the devices of the rig file.

        Result: rig, bench, devices: device, role, driver, link. Least role: observer.
        """
        return self._call("device.list", {})


class HandoverMethods:
    """Methods handover.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def cancel(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """Cancel a waiting or running handover; the run and its data do not change.

        run: id of the run, "R-000318"
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("handover.cancel", {"run": run, "idem": idem})

    def start(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """Repeat the handover of a run (training and evaluation) if it failed, was cancelled or its files are damaged. A
        complete campaign starts its handover automatically.

        run: id of the run, "R-000318"
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("handover.start", {"run": run, "idem": idem})


class LabMethods:
    """Methods lab.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def accept(self, *, lease: str, idem: Optional[str] = None) -> JsonObject:
        """Takes parts of campaigns until the caller's lease of the rig ends.

        lease: your lease of the rig
        idem: idempotency key: a repeated request returns the first answer
        Result: rig, store, is_connected, error, reached_us, unpublished (runs that the store does not know yet), refused
        (publications that the store does not take), newest_refusal, accepted_by (user; null: no part is taken), part
        (campaign, number, fabric, attempt, run, is_lost; null: none). Least role: operator. Changes something.
        """
        return self._call("lab.accept", {"lease": lease, "idem": idem})

    def rigs(self) -> JsonObject:
        """All rigs of the laboratory, as last read from the store.

        Result: rigs (rig, address, bench, state, seen_us, status), read_us (null: not read yet), now_us, is_connected, error.
        Least role: observer.
        """
        return self._call("lab.rigs", {})

    def status(self) -> JsonObject:
        """Connection to the laboratory's store, and the part that this rig has.

        Result: rig, store, is_connected, error, reached_us, unpublished (runs that the store does not know yet), refused
        (publications that the store does not take), newest_refusal, accepted_by (user; null: no part is taken), part
        (campaign, number, fabric, attempt, run, is_lost; null: none). Least role: observer.
        """
        return self._call("lab.status", {})

    def withdraw(self, *, idem: Optional[str] = None) -> JsonObject:
        """Takes no further part; a running one goes on.

        idem: idempotency key: a repeated request returns the first answer
        Result: rig, store, is_connected, error, reached_us, unpublished (runs that the store does not know yet), refused
        (publications that the store does not take), newest_refusal, accepted_by (user; null: no part is taken), part
        (campaign, number, fabric, attempt, run, is_lost; null: none). Least role: operator. Changes something.
        """
        return self._call("lab.withdraw", {"idem": idem})


class LeaseMethods:
    """Methods lease.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def acquire(self, *, scope: Optional[str] = None, ttl_ms: Optional[int] = None, note: Optional[str] = None,
                idem: Optional[str] = None) -> JsonObject:
        """Acquire the lease of the rig for a limited time.

        scope: what to lease (default: this rig)
        ttl_ms: time until it expires unless renewed [ms] (default: 15000)
        note: purpose, shown to other users
        idem: idempotency key: a repeated request returns the first answer
        Result: lease, expires_us. Least role: operator. Changes something.
        """
        return self._call("lease.acquire", {"scope": scope, "ttl_ms": ttl_ms, "note": note, "idem": idem})

    def break_(self, *, lease: str, reason: str, idem: Optional[str] = None) -> JsonObject:
        """Break the lease of another user; all users are notified.

        lease: id of the lease, "L-9c1d40b2-7"
        reason: reason, at least 3 characters
        idem: idempotency key: a repeated request returns the first answer
        Result: the ended lease, reason. Least role: admin. Changes something.
        """
        return self._call("lease.break", {"lease": lease, "reason": reason, "idem": idem})

    def list(self) -> JsonObject:
        """List the leases and their users.

        Result: leases. Least role: observer.
        """
        return self._call("lease.list", {})

    def release(self, *, lease: str, idem: Optional[str] = None) -> JsonObject:
        """Release a lease.

        lease: id of the lease, "L-9c1d40b2-7"
        idem: idempotency key: a repeated request returns the first answer
        Result: the ended lease. Least role: operator. Changes something.
        """
        return self._call("lease.release", {"lease": lease, "idem": idem})

    def renew(self, *, lease: str, ttl_ms: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Extend a lease before it expires.

        lease: id of the lease, "L-9c1d40b2-7"
        ttl_ms: time until it expires unless renewed [ms] (default: 15000)
        idem: idempotency key: a repeated request returns the first answer
        Result: lease, expires_us. Least role: operator. Changes something.
        """
        return self._call("lease.renew", {"lease": lease, "ttl_ms": ttl_ms, "idem": idem})


class LogMethods:
    """Methods log.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def query(self, *, run: Optional[str] = None, kind: Optional[str] = None, since_us: Optional[int] = None,
              until_us: Optional[int] = None, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """Query the daemon's journal by run, kind and time, oldest lines first.

        run: only lines of this run
        kind: only lines of this kind, "state", or of several, separated by commas; the history of the queue:
            "submitted,edited,removed,queue_paused,queue_started,queue_cleared"
        since_us: from this time on, UTC [us]
        until_us: before this time, UTC [us]
        from_: first sequence number: next of the previous page
        most: largest number of lines, up to 10000 (default: 100)
        Result: lines: sequence, t_us, run, kind, by, data; next (null: last page; a short or empty page may have one). Least
        role: observer.
        """
        return self._call("log.query", {"run": run, "kind": kind, "since_us": since_us, "until_us": until_us, "from": from_,
                                        "most": most})

    def tail(self, *, run: Optional[str] = None, most: Optional[int] = None) -> JsonObject:
        """Get the newest lines of the daemon's journal.

        run: only lines of this run
        most: largest number of lines, up to 10000 and 1 MiB (default: 100)
        Result: lines: sequence, t_us, run, kind, by, data; left_off: number of older lines that did not fit; get them with
        log.query. Least role: observer.
        """
        return self._call("log.tail", {"run": run, "most": most})


class QueueMethods:
    """Methods queue.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def add(self, *, recipe: str, lease: Optional[str] = None, seed: Optional[int] = None, name: Optional[str] = None,
            digest: Optional[str] = None, keep_going: Optional[bool] = None, repeat: Optional[int] = None,
            after: Optional[str] = None, parameters: Optional[JsonObject] = None, place: Optional[int] = None,
            if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Add a run of a recipe, as it is now, to the queue; it starts when it is first and the rig is free.

        recipe: name of the recipe, see recipe.list
        lease: your lease of the rig; not needed while the lease of another user is kept for an active run
        seed: seed (default: that of the recipe)
        name: text appended to the name of the run's folder
        digest: expected digest of the resolved recipe, from recipe.check; a changed recipe is refused
        keep_going: start the next run even if this one is stopped, aborted or fails
        repeat: number of runs, 1 to 100 (default: 1); a seed increases by 1 from run to run
        after: start only after this run, "R-000317", is complete ("": none)
        parameters: values of the recipe's parameters by name; the others keep their defaults
        place: place in the queue, from 0 (default: the end)
        if_rev: expected rev of the queue; if it has changed, the request is refused (rev.changed)
        idem: idempotency key: a repeated request returns the first answer
        Result: the run, rev. Least role: operator. Changes something.
        """
        return self._call("queue.add", {"recipe": recipe, "lease": lease, "seed": seed, "name": name, "digest": digest,
                                        "keep_going": keep_going, "repeat": repeat, "after": after, "parameters": parameters,
                                        "place": place, "if_rev": if_rev, "idem": idem})

    def clear(self, *, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Remove all runs from the queue.

        if_rev: expected rev of the queue; if it has changed, the request is refused (rev.changed)
        idem: idempotency key: a repeated request returns the first answer
        Result: rev, paused_by (null: not paused), runs, next (first place of the next page; null: last page). Least role:
        operator. Changes something.
        """
        return self._call("queue.clear", {"if_rev": if_rev, "idem": idem})

    def edit(self, *, run: str, place: Optional[int] = None, seed: Optional[int] = None, name: Optional[str] = None,
             after: Optional[str] = None, lease: Optional[str] = None, keep_going: Optional[bool] = None,
             if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Change a queued run; omitted parameters keep their values.

        run: id of the run, "R-000318"
        place: place in the queue, from 0 (default: the end)
        seed: seed (default: that of the recipe)
        name: text appended to the name of the run's folder
        after: start only after this run, "R-000317", is complete ("": none)
        lease: your lease of the rig; needed with after
        keep_going: start the next run even if this one is stopped, aborted or fails
        if_rev: expected rev of the queue; if it has changed, the request is refused (rev.changed)
        idem: idempotency key: a repeated request returns the first answer
        Result: rev, paused_by (null: not paused), runs, next (first place of the next page; null: last page). Least role:
        operator. Changes something.
        """
        return self._call("queue.edit", {"run": run, "place": place, "seed": seed, "name": name, "after": after, "lease": lease,
                                         "keep_going": keep_going, "if_rev": if_rev, "idem": idem})

    def get(self, *, run: str) -> JsonObject:
        """Get a queued run.

        run: id of the run, "R-000318"
        Result: the run, place, rev. Least role: observer.
        """
        return self._call("queue.get", {"run": run})

    def list(self, *, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """List the queued runs in order.

        from_: first place of the page: next of the previous page (default: 0)
        most: largest number of runs, up to 1000
        Result: rev, paused_by (null: not paused), runs, next (first place of the next page; null: last page). Least role:
        observer.
        """
        return self._call("queue.list", {"from": from_, "most": most})

    def move(self, *, run: str, place: Optional[int] = None, if_rev: Optional[int] = None,
             idem: Optional[str] = None) -> JsonObject:
        """Move a queued run to another place.

        run: id of the run, "R-000318"
        place: place in the queue, from 0 (default: the end)
        if_rev: expected rev of the queue; if it has changed, the request is refused (rev.changed)
        idem: idempotency key: a repeated request returns the first answer
        Result: rev, paused_by (null: not paused), runs, next (first place of the next page; null: last page). Least role:
        operator. Changes something.
        """
        return self._call("queue.move", {"run": run, "place": place, "if_rev": if_rev, "idem": idem})

    def pause(self, *, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Pause the queue: no further run starts; the active run continues.

        if_rev: expected rev of the queue; if it has changed, the request is refused (rev.changed)
        idem: idempotency key: a repeated request returns the first answer
        Result: rev, paused_by (null: not paused), runs, next (first place of the next page; null: last page). Least role:
        operator. Changes something.
        """
        return self._call("queue.pause", {"if_rev": if_rev, "idem": idem})

    def remove(self, *, run: str, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Remove a run from the queue.

        run: id of the run, "R-000318"
        if_rev: expected rev of the queue; if it has changed, the request is refused (rev.changed)
        idem: idempotency key: a repeated request returns the first answer
        Result: rev, paused_by (null: not paused), runs, next (first place of the next page; null: last page). Least role:
        operator. Changes something.
        """
        return self._call("queue.remove", {"run": run, "if_rev": if_rev, "idem": idem})

    def start(self, *, lease: str, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Resume the queue: the next run starts when the rig is free. A queue with runs is paused after a run that is not
        complete, after a restart and after a reset.

        lease: your lease of the rig
        if_rev: expected rev of the queue; if it has changed, the request is refused (rev.changed)
        idem: idempotency key: a repeated request returns the first answer
        Result: rev, paused_by (null: not paused), runs, next (first place of the next page; null: last page). Least role:
        operator. Changes something.
        """
        return self._call("queue.start", {"lease": lease, "if_rev": if_rev, "idem": idem})


class RecipeMethods:
    """Methods recipe.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def check(self, *, recipe: str, seed: Optional[int] = None, parameters: Optional[JsonObject] = None,
              content: Optional[JsonObject] = None) -> JsonObject:
        """Check a recipe on this rig and list all problems; nothing moves.

        recipe: name of the recipe
        seed: seed (default: that of the recipe)
        parameters: values of the recipe's parameters by name; the others keep their defaults
        content: recipe to check instead of the file in the folder
        Result: ok, digest (of the resolved recipe), file_digest, parameters (as declared), plan (eta_s including people_s for
        operator steps, asks, next_attention, envelope of each stage with its margin, data_bytes of the samples, bytes that
        must be free on the disk including the reserve), problems of the recipe, the rig file and the bench built without
        devices: file, where, message, expected, got, hint; warnings, disk_ok. Least role: observer.
        """
        return self._call("recipe.check", {"recipe": recipe, "seed": seed, "parameters": parameters, "content": content})

    def diff(self, *, recipe: str, other: str) -> JsonObject:
        """Compare two recipes; differences are named by JSON pointer.

        recipe: name of a recipe, or a run for the recipe it recorded
        other: the other recipe, in the same form
        Result: same (as written), same_campaign (planned on this rig with default parameters; null: not known), count,
        differences: where, change, was, is; the first 1000. Least role: observer.
        """
        return self._call("recipe.diff", {"recipe": recipe, "other": other})

    def get(self, *, recipe: str) -> JsonObject:
        """Get a recipe of the daemon's folder as written.

        recipe: name of the recipe
        Result: recipe, text, content (the text as JSON; null: not JSON), file_digest. Least role: observer.
        """
        return self._call("recipe.get", {"recipe": recipe})

    def list(self) -> JsonObject:
        """List the recipes in the daemon's folder.

        Result: recipes (names), parameters (by recipe, as declared; only recipes with parameters), descriptions (by recipe;
        only recipes with a description). Least role: observer.
        """
        return self._call("recipe.list", {})

    def plan(self, *, recipe: str, seed: Optional[int] = None, from_: Optional[int] = None, most: Optional[int] = None,
             parameters: Optional[JsonObject] = None) -> JsonObject:
        """Plan a recipe on this rig: phases, and each trial with its expected time.

        recipe: name of a recipe, or a run for the recipe it recorded
        seed: seed (default: that of the recipe or run)
        from_: index of the first trial (default: 0)
        most: largest number of trials, up to 1000 (default: 100)
        parameters: values of the recipe's parameters by name; the others keep their defaults
        Result: name, digest (of the resolved recipe), parameters (as declared), plan_digest, trials, duration_s, people_s,
        bytes, hand_over, explorations, steps, next. Least role: observer.
        """
        return self._call("recipe.plan", {"recipe": recipe, "seed": seed, "from": from_, "most": most, "parameters": parameters})

    def put(self, *, recipe: str, content: Optional[JsonObject] = None, text: Optional[str] = None, if_digest: Optional[str] = None,
            parameters: Optional[JsonObject] = None, idem: Optional[str] = None) -> JsonObject:
        """Write a recipe that recipe.check accepts to the daemon's folder.

        recipe: name of the recipe
        content: the recipe as JSON; see recipe.schema
        text: the recipe as text, written unchanged; instead of content
        if_digest: file_digest of the recipe to replace; needed if the name is in use
        parameters: values used in the check, for parameters without default
        idem: idempotency key: a repeated request returns the first answer
        Result: recipe, digest, replaced (digest, or null), trials. Least role: engineer. Changes something.
        """
        return self._call("recipe.put", {"recipe": recipe, "content": content, "text": text, "if_digest": if_digest,
                                         "parameters": parameters, "idem": idem})

    def schema(self) -> JsonObject:
        """Get the JSON Schema of a recipe.

        Result: a JSON Schema of draft 2020-12 with x-unit. Least role: observer.
        """
        return self._call("recipe.schema", {})


class RigMethods:
    """Methods rig.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def describe(self) -> JsonObject:
        """Describe the rig and its limits, from its rig file.

        Result: rig, bench (simulated, emulated, real), simulated, wrench (false: no force sensor, and the caps are null),
        force_cap_n, torque_cap_nm, travel by axis, fixed (positions of axes without a stage), plate: origin, size,
        surface_z_m; footprint of the probe, clearance_m, taxels, taxel_shape (rows and columns, or places; null: not stated;
        several arrays: each with device, taxels and shape), taxel_span_counts (full colour range of a taxel map; null: not
        stated), fabrics. Least role: observer.
        """
        return self._call("rig.describe", {})

    def estop(self, *, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Stop as rig.halt does; only an engineer can reset it. This is a stop by software: it cuts no power.

        reason: reason, shown to the person who resets the rig
        idem: idempotency key: a repeated request returns the first answer
        Result: latched, latch, warnings (errors of the request, which was executed nevertheless; only if there are any).
        Least role: observer. Changes something.
        """
        return self._call("rig.estop", {"reason": reason, "idem": idem})

    def halt(self, *, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Stop all motion in place and latch the rig; repeated calls do so again. Needs no lease and no role, and on the local
        socket no session.open.

        reason: reason, shown to the person who resets the rig
        idem: idempotency key: a repeated request returns the first answer
        Result: latched, latch, warnings (errors of the request, which was executed nevertheless; only if there are any).
        Least role: observer. Changes something.
        """
        return self._call("rig.halt", {"reason": reason, "idem": idem})

    def jog(self, *, lease: str, axis: str, distance: float, idem: Optional[str] = None) -> JsonObject:
        """Move one axis by at most 5 mm or 1 degree, at a tenth of its speed, outside a run; every motion except z up stops when
        the force changes by 1 N; answers when the motion has ended.

        lease: your lease of the rig
        axis: axis (x, y, z, rx, ry)
        distance: distance [m], for rx and ry [rad]; positive z is down
        idem: idempotency key: a repeated request returns the first answer
        Result: order, from, to (positions by axis), relative (z was not homed: it rose from its present position), outcome,
        rig (safe: the probe is at the clear height; holding; unknown), error. Least role: operator. Changes something.
        """
        return self._call("rig.jog", {"lease": lease, "axis": axis, "distance": distance, "idem": idem})

    def lock(self, *, reason: str, idem: Optional[str] = None) -> JsonObject:
        """Lock the rig out in your name: until rig.unlock nothing moves, also after a restart.

        reason: reason, shown to other users
        idem: idempotency key: a repeated request returns the first answer
        Result: as rig.state. Least role: operator. Changes something.
        """
        return self._call("rig.lock", {"reason": reason, "idem": idem})

    def park(self, *, lease: str, idem: Optional[str] = None) -> JsonObject:
        """Lift the probe, then move x, y, rx and ry to the rig file's park position, outside a run; every stage must be homed;
        answers when the motion has ended.

        lease: your lease of the rig
        idem: idempotency key: a repeated request returns the first answer
        Result: order, from, to (positions by axis), relative (z was not homed: it rose from its present position), outcome,
        rig (safe: the probe is at the clear height; holding; unknown), error. Least role: operator. Changes something.
        """
        return self._call("rig.park", {"lease": lease, "idem": idem})

    def reset(self, *, reason: str, idem: Optional[str] = None) -> JsonObject:
        """Clear the latch after inspecting the rig; an e-stop needs an engineer. Nothing moves, the fact does not change, and a
        queue with runs is paused.

        reason: result of the inspection, at least 3 characters
        idem: idempotency key: a repeated request returns the first answer
        Result: latched, and as rig.state. Least role: operator. Changes something.
        """
        return self._call("rig.reset", {"reason": reason, "idem": idem})

    def retract(self, *, lease: str, idem: Optional[str] = None) -> JsonObject:
        """Lift the probe to the clear height, outside a run and without homing; answers when the motion has ended. If z is not
        homed, it rises by at most the clearance.

        lease: your lease of the rig
        idem: idempotency key: a repeated request returns the first answer
        Result: order, from, to (positions by axis), relative (z was not homed: it rose from its present position), outcome,
        rig (safe: the probe is at the clear height; holding; unknown), error. Least role: operator. Changes something.
        """
        return self._call("rig.retract", {"lease": lease, "idem": idem})

    def state(self) -> JsonObject:
        """Get the state of the rig: motion, how the last run left it, latch and lock-out.

        Result: rig (moving, holding, safe, unknown or latched), run, maintenance (motion outside a run: retract, park or
        jog), fact (safe, holding or unknown: how the newest run left it), left_by, acknowledged (a person has reset it
        since), latch (halt or estop), latched_by (with the reason), locked: by, reason, since_us. Least role: observer.
        """
        return self._call("rig.state", {})

    def unlock(self, *, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Remove your lock-out, or as an engineer that of another user with a reason.

        reason: reason; needed for the lock-out of another user
        idem: idempotency key: a repeated request returns the first answer
        Result: as rig.state. Least role: operator. Changes something.
        """
        return self._call("rig.unlock", {"reason": reason, "idem": idem})


class RpcMethods:
    """Methods rpc.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def discover(self) -> JsonObject:
        """Get this OpenRPC document.

        Result: OpenRPC. Least role: observer.
        """
        return self._call("rpc.discover", {})


class RunMethods:
    """Methods run.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def abort(self, *, run: str, break_lease: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Stop motion, retract the probe and end the run.

        run: id of the run, "R-000318"
        break_lease: reason to break the lease of another user for this run (abort: as operator, else as engineer)
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.abort", {"run": run, "break_lease": break_lease, "idem": idem})

    def annotate(self, *, run: str, tags: Optional[List[Any]] = None, note: Optional[str] = None,
                 idem: Optional[str] = None) -> JsonObject:
        """Set the tags or the note of a run, at any time; its data do not change. Journal kind: "note".

        run: id of the run, "R-000318"
        tags: the new list of tags: at most 16, of at most 40 characters
        note: the new note, at most 4000 characters
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.annotate", {"run": run, "tags": tags, "note": note, "idem": idem})

    def confirm(self, *, run: str, step: str, break_lease: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Confirm that the requested operator step ("attention") is done; the run continues.

        run: id of the run, "R-000318"
        step: step of the run's "attention", "Q-12"
        break_lease: reason to break the lease of another user for this run (abort: as operator, else as engineer)
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.confirm", {"run": run, "step": step, "break_lease": break_lease, "idem": idem})

    def get(self, *, run: str) -> JsonObject:
        """Get a run.

        run: id of the run, "R-000318"
        Result: the run; submitted_by: who queued it; by: who changed it last; attention: the next operator step (null: none);
        next_attention_us: time of its prompt, past or expected; campaign_since, if the campaign was resumed without the
        daemon (weft run --resume): present content of its folder, trials_done, trials_planned, complete, dataset_sha256;
        promise, if an accuracy of the simulation was requested: held; result, the accuracy of each exploration (null: not
        evaluated): exploration, learner, protocol, accuracy, ci95, tested, unit, labels, not_tested, base_rate, chance. Least
        role: observer.
        """
        return self._call("run.get", {"run": run})

    def list(self, *, state: Optional[str] = None, search: Optional[str] = None, from_: Optional[str] = None,
             most: Optional[int] = None, order: Optional[str] = None) -> JsonObject:
        """List the runs in pages.

        state: only runs in this state
        search: only runs with this text in id, recipe, name, fabrics, tags, note or outcome, ignoring the case of a to z; at
            most 40 characters
        from_: first run of the page: next of the previous page
        most: largest number of runs, up to 1000 and 1 MiB
        order: order of the runs (default: oldest; oldest, newest)
        Result: runs, next (null: last page). Least role: observer.
        """
        return self._call("run.list", {"state": state, "search": search, "from": from_, "most": most, "order": order})

    def pause(self, *, run: str, at: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Pause the run before the next trial, or now and repeat the interrupted trial. If no trial is left, the queue is paused
        instead (pause_carried_over).

        run: id of the run, "R-000318"
        at: pause point (default: boundary; boundary, now)
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.pause", {"run": run, "at": at, "idem": idem})

    def recover(self, *, run: str, choice: str, preview: Optional[bool] = None, lease: Optional[str] = None,
                idem: Optional[str] = None) -> JsonObject:
        """Recover an interrupted, stopped, aborted or failed run with trials left: resume it, discard it (no data set is made),
        or keep its complete trials as a data set.

        run: id of the run, "R-000318"
        choice: choice (resume, discard, keep-partial)
        preview: only report what would be done
        lease: your lease of the rig; needed without preview
        idem: idempotency key: a repeated request returns the first answer
        Result: the run, or will, trials_planned, trials_done, trials_left. Least role: operator. Changes something.
        """
        return self._call("run.recover", {"run": run, "choice": choice, "preview": preview, "lease": lease, "idem": idem})

    def resume(self, *, run: str, preview: Optional[bool] = None, lease: Optional[str] = None, break_lease: Optional[str] = None,
               idem: Optional[str] = None) -> JsonObject:
        """Resume a held run with its next trial: retract, position, bias; or a recoverable ended run with its interrupted trial.

        run: id of the run, "R-000318"
        preview: for an ended run: only report what would be done
        lease: your lease of the rig; needed for an ended run
        break_lease: reason to break the lease of another user for this run (abort: as operator, else as engineer)
        idem: idempotency key: a repeated request returns the first answer
        Result: the run, or will, trials_planned, trials_done, trials_left. Least role: operator. Changes something.
        """
        return self._call("run.resume", {"run": run, "preview": preview, "lease": lease, "break_lease": break_lease, "idem": idem})

    def samples(self, *, after_s: Optional[float] = None, most: Optional[int] = None) -> JsonObject:
        """Get sensor values of the last 40 minutes (bench time) of the newest run, for display. They are not a record.

        after_s: only rows after this bench time [s]
        most: largest number of rows, up to 3000 (default: 1500). Neighbouring rows are merged: the last values with the
            extremes of all
        Result: run (null: none yet), columns, rows (values in the order of columns, null: not known), newest counts and
        rest_counts as in stream:taxels. Least role: observer.
        """
        return self._call("run.samples", {"after_s": after_s, "most": most})

    def start(self, *, recipe: str, lease: Optional[str] = None, seed: Optional[int] = None, name: Optional[str] = None,
              digest: Optional[str] = None, keep_going: Optional[bool] = None, repeat: Optional[int] = None,
              after: Optional[str] = None, parameters: Optional[JsonObject] = None, idem: Optional[str] = None) -> JsonObject:
        """Queue a run of a recipe, as it is now; it starts when it is first and the rig is free.

        recipe: name of the recipe, see recipe.list
        lease: your lease of the rig; not needed while the lease of another user is kept for an active run
        seed: seed (default: that of the recipe)
        name: text appended to the name of the run's folder
        digest: expected digest of the resolved recipe, from recipe.check; a changed recipe is refused
        keep_going: start the next run even if this one is stopped, aborted or fails
        repeat: number of runs, 1 to 100 (default: 1); a seed increases by 1 from run to run
        after: start only after this run, "R-000317", is complete ("": none)
        parameters: values of the recipe's parameters by name; the others keep their defaults
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.start", {"recipe": recipe, "lease": lease, "seed": seed, "name": name, "digest": digest,
                                        "keep_going": keep_going, "repeat": repeat, "after": after, "parameters": parameters,
                                        "idem": idem})

    def stop(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """End the run after the current trial and the clean-up.

        run: id of the run, "R-000318"
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.stop", {"run": run, "idem": idem})

    def wait(self, *, run: str, hand_over: Optional[bool] = None) -> JsonObject:
        """Wait until the run has ended, then answer.

        run: id of the run, "R-000318"
        hand_over: also wait for the handover
        Result: the run. Least role: observer.
        """
        return self._call("run.wait", {"run": run, "hand_over": hand_over})

    def withdraw(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """Remove a run from the queue: the old name of queue.remove, kept for one version.

        run: id of the run, "R-000318"
        idem: idempotency key: a repeated request returns the first answer
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.withdraw", {"run": run, "idem": idem})


class SessionMethods:
    """Methods session.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def close(self, *, session: Optional[str] = None, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Close a session after its answer is sent: your own, or as an admin another one with a reason. Started runs continue,
        and its leases last until they expire.

        session: name of the session, "s-41" (default: your own)
        reason: reason, for the client and the journal; needed for the session of another user
        idem: idempotency key: a repeated request returns the first answer
        Result: closed. Least role: observer. Changes something.
        """
        return self._call("session.close", {"session": session, "reason": reason, "idem": idem})

    def list(self) -> JsonObject:
        """List the connected clients with an open session.

        Result: sessions: session, user, client, role, local (through the Unix socket), subscriptions, waiting_calls. Least
        role: observer.
        """
        return self._call("session.list", {})

    def open(self, *, client: str, version: Optional[str] = None, protocol: Optional[str] = None, token: Optional[str] = None,
             want: Optional[List[Any]] = None) -> JsonObject:
        """Open the session: identify the client, agree on protocol and role (first request).

        client: name of the client program
        version: version of the client program
        protocol: requested protocol version, "1.x"
        token: token; needed unless the Unix socket identifies the user
        want: requested features (default: all); the result lists the supported ones
        Result: session, user (of a token: see token.add), role, protocol, features, epoch, seq, ready. Least role: observer.
        """
        return self._call("session.open", {"client": client, "version": version, "protocol": protocol, "token": token,
                                           "want": want})

    def whoami(self) -> JsonObject:
        """Get your session, user and role.

        Result: session, client, user, role. Least role: observer.
        """
        return self._call("session.whoami", {})


class SimMethods:
    """Methods sim.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def clear(self, *, device: str, fault: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """End the injected faults of a device, including those of the rig file.

        device: name of the device, see device.list
        fault: kind of the fault (default: all)
        idem: idempotency key: a repeated request returns the first answer
        Result: device, fault, run. Least role: engineer. Changes something.
        """
        return self._call("sim.clear", {"device": device, "fault": fault, "idem": idem})

    def clock(self, *, pace: float, idem: Optional[str] = None) -> JsonObject:
        """Set the simulation speed, for the active and later runs; the daemon starts with --pace.

        pace: bench seconds per wall second, 1 to 1000000; 0: as fast as possible
        idem: idempotency key: a repeated request returns the first answer
        Result: pace. Least role: operator. Changes something.
        """
        return self._call("sim.clock", {"pace": pace, "idem": idem})

    def inject(self, *, device: str, fault: str, start_s: Optional[float] = None, duration_s: Optional[float] = None,
               probability: Optional[float] = None, amount: Optional[float] = None, towards: Optional[str] = None,
               idem: Optional[str] = None) -> JsonObject:
        """Inject a fault into a device of the active run, on a simulated or emulated bench, once its devices are armed; kinds:
        docs/reference/faults.md.

        device: name of the device, see device.list
        fault: kind of the fault, "drop"
        start_s: delay in bench time [s] (default: 0)
        duration_s: duration [s] (default: unlimited)
        probability: probability for each message or reading, 0 to 1 (default: 1)
        amount: size of the fault, in the unit of its kind
        towards: direction of a link fault (default: host; host, device)
        idem: idempotency key: a repeated request returns the first answer
        Result: the fault, run. Least role: engineer. Changes something.
        """
        return self._call("sim.inject", {"device": device, "fault": fault, "start_s": start_s, "duration_s": duration_s,
                                         "probability": probability, "amount": amount, "towards": towards, "idem": idem})


class SubMethods:
    """Methods sub.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def close(self, *, sub: str) -> JsonObject:
        """Close a subscription.

        sub: id of the subscription, "u3"
        Result: closed. Least role: observer.
        """
        return self._call("sub.close", {"sub": sub})

    def credit(self, *, sub: str, events: int) -> JsonObject:
        """Grant more events to a subscription opened with credit.

        sub: id of the subscription, "u3"
        events: number of further events, 1 to 1000000
        Result: sub, credit. Least role: observer.
        """
        return self._call("sub.credit", {"sub": sub, "events": events})

    def open(self, *, topics: List[Any], mode: Optional[str] = None, max_hz: Optional[float] = None, credit: Optional[int] = None,
             from_seq: Optional[int] = None, epoch: Optional[str] = None) -> JsonObject:
        """Subscribe to events: a snapshot first, then the changes.

        topics: topics, "run:R-000318"; "run:*" for all of a kind
        mode: delivery (default: latest; latest: merged events, every: all events, gaps are reported)
        max_hz: largest rate of mode latest [Hz] (default: 20)
        credit: number of events to send before sub.credit grants more (default: unlimited); events dropped meanwhile are
            reported as a gap
        from_seq: send all events after this number instead of a snapshot
        epoch: epoch of the daemon that numbered from_seq
        Result: sub, seq, snapshot (by topic, at most 1 MiB), left_off (number of topics that did not fit, those that changed
        longest ago; request them by name, or with run.list). Least role: observer.
        """
        return self._call("sub.open", {"topics": topics, "mode": mode, "max_hz": max_hz, "credit": credit, "from_seq": from_seq,
                                       "epoch": epoch})


class SystemMethods:
    """Methods system.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def info(self) -> JsonObject:
        """Get version, rig and settings of the daemon.

        Result: product, version, rig, bench ("simulated" or "real"), pace, http (null: not served), epoch, seq. Least role:
        observer.
        """
        return self._call("system.info", {})

    def metrics(self) -> JsonObject:
        """Get counters and free disk space.

        Result: up_s, seq (events published), listeners, leases, queued, runs by state, disk_free_bytes (null: not known).
        Least role: observer.
        """
        return self._call("system.metrics", {})

    def ready(self) -> JsonObject:
        """Check whether a run can start and list all blockers.

        Result: ok, blockers. Least role: observer.
        """
        return self._call("system.ready", {})

    def time(self) -> JsonObject:
        """Get the UTC and the monotonic clock.

        Result: t_us (UTC), mono_us. Least role: observer.
        """
        return self._call("system.time", {})


class TokenMethods:
    """Methods token.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def add(self, *, name: str, role: Optional[str] = None, days: Optional[int] = None, own: Optional[bool] = None,
            idem: Optional[str] = None) -> JsonObject:
        """Create a token for TCP and HTTP; only this answer contains it.

        name: name of the token, not yet in use
        role: role (default: operator; observer, operator, engineer, admin)
        days: time until it expires [days] (default: 30)
        own: create it for yourself, a user of the machine without a token: its client acts as you within its role, with your
            leases and idempotency keys. Otherwise its user is token:NAME
        idem: idempotency key: a repeated request returns the first answer
        Result: name, role, expires_us, user (of the token), token. Least role: admin. Changes something.
        """
        return self._call("token.add", {"name": name, "role": role, "days": days, "own": own, "idem": idem})


class Api:
    """All methods by noun: api.run.start(recipe="m1", lease="L-1")."""

    def __init__(self, call: Call) -> None:
        self.classify = ClassifyMethods(call)
        self.data = DataMethods(call)
        self.device = DeviceMethods(call)
        self.handover = HandoverMethods(call)
        self.lab = LabMethods(call)
        self.lease = LeaseMethods(call)
        self.log = LogMethods(call)
        self.queue = QueueMethods(call)
        self.recipe = RecipeMethods(call)
        self.rig = RigMethods(call)
        self.rpc = RpcMethods(call)
        self.run = RunMethods(call)
        self.session = SessionMethods(call)
        self.sim = SimMethods(call)
        self.sub = SubMethods(call)
        self.system = SystemMethods(call)
        self.token = TokenMethods(call)

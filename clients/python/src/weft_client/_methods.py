"""Every method of the daemon's API, version 1.0.0. Made by generate_methods.py from `rpc.discover`; do not edit.

Each answers the result as it came, a dict; what it has is said in its documentation. Fields that are not known here are of a later version.
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
        """The newest vote of a run whose recipe has a live vote; each is an event of the topic "vote:R-000318" too.

        run: its name, "R-000318"
        Result: run, vote: trial, fabric, exploration, repetition, slide_s, winner, probability (by label), none_of_these,
        model_bench, ends_slide; null before the first. Least role: observer.
        """
        return self._call("classify.live", {"run": run})


class DataMethods:
    """Methods data.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def certificate(self, *, run: str, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """What a run's data set was recorded with, and the digests that data.verify goes by.

        run: its name, "R-000318"
        from_: the first attempt at a trial that is told, 0
        most: attempts, 100; at most 1000
        Result: run, bench, name, seed, software_version, recipe_sha256, rig_sha256, dataset_sha256, trials_planned, attempts,
        ended_early, devices: name, driver, identity; files: name, bytes, sha256, path; path of the whole certificate; trials:
        name, outcome, sha256, gaps; next. Least role: observer.
        """
        return self._call("data.certificate", {"run": run, "from": from_, "most": most})

    def export(self, *, run: str, format: Optional[str] = None, stream: Optional[str] = None, exploration: Optional[str] = None,
               idem: Optional[str] = None) -> JsonObject:
        """Makes a file of the complete trials of a run that is over, also of one that was interrupted; it is had by GET of
        `path` over HTTP.

        run: its name, "R-000318"
        format: hdf5, a data set (default), features-csv, the table of its features, or samples-csv, a table of the samples of
            one stream
        stream: of samples: taxels, wrench, stages, acceleration or sound
        exploration: whose features, where the campaign has several
        idem: key of this change: asked again, the first answer comes
        Result: run, format, name, bytes, sha256, path, dataset_sha256, bench, trials, trials_planned. Least role: operator.
        Changes something.
        """
        return self._call("data.export", {"run": run, "format": format, "stream": stream, "exploration": exploration, "idem": idem})

    def get(self, *, run: str) -> JsonObject:
        """The files of a run that has ended; bytes are had by GET of `path` over HTTP, with Range, the digest as ETag.

        run: its name, "R-000318"
        Result: run, outcome, dataset_sha256, folder, exports: name, state (current, outdated where the run went on since,
        discarded or missing), trials, trials_done, trials_done_now; files: name, bytes, sha256, path. Least role: observer.
        """
        return self._call("data.get", {"run": run})

    def import_(self, *, folder: str, idem: Optional[str] = None) -> JsonObject:
        """Add the campaign in a folder, made by weft run, to the catalogue as a run that has ended. The folder stays where it
        is.

        folder: on the daemon's machine; a relative one lies in its data folder
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("data.import", {"folder": folder, "idem": idem})

    def list(self, *, from_: Optional[str] = None, most: Optional[int] = None, order: Optional[str] = None) -> JsonObject:
        """Data sets of all runs, page by page, complete or not.

        from_: this run on: next of the page before
        most: runs, 1000 at most, and no more than 1 MiB
        order: oldest (default) or newest first
        Result: datasets: run, recipe, name, created_us, outcome (of the run), dataset_sha256 (of the file that is there now),
        campaign_since (as run.get), handover, result (as run.get); next, null where there is no more. Least role: observer.
        """
        return self._call("data.list", {"from": from_, "most": most, "order": order})

    def trial(self, *, run: str, trial: str, points: Optional[int] = None) -> JsonObject:
        """The curves of one trial of a run that is over, reduced for a picture: least and greatest value in each point, null
        where samples are missing.

        run: its name, "R-000318"
        trial: its name, as data.trials has it
        points: of a curve at most, 1200; 10 to 5000
        Result: run, trial, bench, label, exploration, repetition, attempt, outcome, begin_s (on the bench's clock; other
        times are from there), phases: phase, begin_s, end_s; target: phase, force_N, band_N; force: t_s, fx_N, fy_N, fz_N
        (each min, max); stages: t_s, x_mm ... ry_deg likewise; taxels: mean_S_counts, mean_M_counts, t_s, counts (of at most
        300 frames). Least role: observer.
        """
        return self._call("data.trial", {"run": run, "trial": trial, "points": points})

    def trials(self, *, run: str, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """Every attempt at a trial of a run that is over, page by page, in the order of the plan.

        run: its name, "R-000318"
        from_: the first attempt that is told, 0
        most: attempts, 50; at most 200
        Result: run, bench, trials: trial (its name), index (of the plan), attempt, label, exploration, repetition, piece,
        mounting, patch, outcome, reason (why it was rejected or failed), lost_frames, force_rms_error_N, force_worst_error_N,
        force_in_band_share, while the force was held, rest: weight_N, before_N, after_N; next. Least role: observer.
        """
        return self._call("data.trials", {"run": run, "from": from_, "most": most})

    def verify(self, *, run: str) -> JsonObject:
        """Whether a run's campaign file, data set and hand-over are what was recorded, byte by byte.

        run: its name, "R-000318"
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
        """What a device's driver may be told, and what the rig file tells it.

        device: its name, "stage.z"
        Result: device, role, driver, link, summary, bench, plugin (its file, or null), config, config_schema: JSON Schema,
        draft 2020-12, with x-unit, and x-safety where a value guards somebody or something. Least role: observer.
        """
        return self._call("device.describe", {"device": device})

    def list(self) -> JsonObject:
        """The rig's devices, as its file has them.

        Result: rig, bench, devices: device, role, driver, link. Least role: observer.
        """
        return self._call("device.list", {})


class HandoverMethods:
    """Methods handover.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def cancel(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """Ends a hand-over that waits or runs; the run and its data stay as they are.

        run: its name, "R-000318"
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("handover.cancel", {"run": run, "idem": idem})

    def start(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """Trains and evaluates once more what a run's recipe hands over, where that failed, was cancelled or its files were
        damaged; by itself it is done once a campaign is complete.

        run: its name, "R-000318"
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("handover.start", {"run": run, "idem": idem})


class LeaseMethods:
    """Methods lease.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def acquire(self, *, scope: Optional[str] = None, ttl_ms: Optional[int] = None, note: Optional[str] = None,
                idem: Optional[str] = None) -> JsonObject:
        """Takes the rig for yourself, for a while.

        scope: this rig, where it is left out
        ttl_ms: how long it lasts without renewal [ms], 15000
        note: for the others, what for
        idem: key of this change: asked again, the first answer comes
        Result: lease, expires_us. Least role: operator. Changes something.
        """
        return self._call("lease.acquire", {"scope": scope, "ttl_ms": ttl_ms, "note": note, "idem": idem})

    def break_(self, *, lease: str, reason: str, idem: Optional[str] = None) -> JsonObject:
        """Takes it away from whoever holds it; told to all.

        lease: its name, "L-9c1d40b2-7"
        reason: a few words
        idem: key of this change: asked again, the first answer comes
        Result: the lease that is over, reason. Least role: admin. Changes something.
        """
        return self._call("lease.break", {"lease": lease, "reason": reason, "idem": idem})

    def list(self) -> JsonObject:
        """Who holds what.

        Result: leases. Least role: observer.
        """
        return self._call("lease.list", {})

    def release(self, *, lease: str, idem: Optional[str] = None) -> JsonObject:
        """Done with it.

        lease: its name, "L-9c1d40b2-7"
        idem: key of this change: asked again, the first answer comes
        Result: the lease that is over. Least role: operator. Changes something.
        """
        return self._call("lease.release", {"lease": lease, "idem": idem})

    def renew(self, *, lease: str, ttl_ms: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """For longer.

        lease: its name, "L-9c1d40b2-7"
        ttl_ms: how long it lasts without renewal [ms], 15000
        idem: key of this change: asked again, the first answer comes
        Result: lease, expires_us. Least role: operator. Changes something.
        """
        return self._call("lease.renew", {"lease": lease, "ttl_ms": ttl_ms, "idem": idem})


class LogMethods:
    """Methods log.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def query(self, *, run: Optional[str] = None, kind: Optional[str] = None, since_us: Optional[int] = None,
              until_us: Optional[int] = None, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """Lines of the daemon's journal, oldest first, by run, kind and time.

        run: of this run only
        kind: of this kind only, "state"; of several, separated by commas: the queue's history is
            "submitted,edited,removed,queue_paused,queue_started,queue_cleared"
        since_us: not before, UTC
        until_us: before, UTC
        from_: this sequence number on: next of the page before
        most: lines, 100; at most 10000
        Result: lines: sequence, t_us, run, kind, by, data; next, null where there is no more: a page may be short, or empty,
        and have one. Least role: observer.
        """
        return self._call("log.query", {"run": run, "kind": kind, "since_us": since_us, "until_us": until_us, "from": from_,
                                        "most": most})

    def tail(self, *, run: Optional[str] = None, most: Optional[int] = None) -> JsonObject:
        """The newest lines of the daemon's journal.

        run: of this run only
        most: lines, 100; 10000 at most, and no more than 1 MiB
        Result: lines: sequence, t_us, run, kind, by, data; left_off: so many older ones had no room, log.query has them.
        Least role: observer.
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
        """Puts a campaign in line, with its recipe as it is now; it begins when its turn comes and the rig is free.

        recipe: name of a recipe, see recipe.list
        lease: your lease of the rig; not needed while another user's is kept for a run under way
        seed: in place of the recipe's
        name: added to the folder's name
        digest: of the resolved recipe that is meant, as recipe.check has it; another one is refused
        keep_going: let the next run begin also where this one is stopped, aborted or fails
        repeat: as many runs of it, 1 to 100; a seed counts up from one to the next; 1
        after: a run, "R-000317": begin once that one has ended complete; "" for none
        parameters: values of the recipe's parameters by name; defaults where left out
        place: in line, from 0; the end where it is left out
        if_rev: rev of the queue as you know it: refused (rev.changed) where it is another by now
        idem: key of this change: asked again, the first answer comes
        Result: the run, rev. Least role: operator. Changes something.
        """
        return self._call("queue.add", {"recipe": recipe, "lease": lease, "seed": seed, "name": name, "digest": digest,
                                        "keep_going": keep_going, "repeat": repeat, "after": after, "parameters": parameters,
                                        "place": place, "if_rev": if_rev, "idem": idem})

    def clear(self, *, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Take all runs that wait out of the queue.

        if_rev: rev of the queue as you know it: refused (rev.changed) where it is another by now
        idem: key of this change: asked again, the first answer comes
        Result: rev, paused_by (null where it is not), runs, next (the place of the page that follows; null: none). Least
        role: operator. Changes something.
        """
        return self._call("queue.clear", {"if_rev": if_rev, "idem": idem})

    def edit(self, *, run: str, place: Optional[int] = None, seed: Optional[int] = None, name: Optional[str] = None,
             after: Optional[str] = None, lease: Optional[str] = None, keep_going: Optional[bool] = None,
             if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Change a run that waits; what is left out stays.

        run: its name, "R-000318"
        place: in line, from 0; the end where it is left out
        seed: in place of the recipe's
        name: added to the folder's name
        after: a run, "R-000317": begin once that one has ended complete; "" for none
        lease: your lease of the rig; needed with after
        keep_going: let the next run begin also where this one is stopped, aborted or fails
        if_rev: rev of the queue as you know it: refused (rev.changed) where it is another by now
        idem: key of this change: asked again, the first answer comes
        Result: rev, paused_by (null where it is not), runs, next (the place of the page that follows; null: none). Least
        role: operator. Changes something.
        """
        return self._call("queue.edit", {"run": run, "place": place, "seed": seed, "name": name, "after": after, "lease": lease,
                                         "keep_going": keep_going, "if_rev": if_rev, "idem": idem})

    def get(self, *, run: str) -> JsonObject:
        """One that waits.

        run: its name, "R-000318"
        Result: the run, place, rev. Least role: observer.
        """
        return self._call("queue.get", {"run": run})

    def list(self, *, from_: Optional[int] = None, most: Optional[int] = None) -> JsonObject:
        """The runs that wait for the rig, the next first.

        from_: this place on: next of the page before; 0
        most: runs, 1000 at most
        Result: rev, paused_by (null where it is not), runs, next (the place of the page that follows; null: none). Least
        role: observer.
        """
        return self._call("queue.list", {"from": from_, "most": most})

    def move(self, *, run: str, place: Optional[int] = None, if_rev: Optional[int] = None,
             idem: Optional[str] = None) -> JsonObject:
        """Another place in line.

        run: its name, "R-000318"
        place: in line, from 0; the end where it is left out
        if_rev: rev of the queue as you know it: refused (rev.changed) where it is another by now
        idem: key of this change: asked again, the first answer comes
        Result: rev, paused_by (null where it is not), runs, next (the place of the page that follows; null: none). Least
        role: operator. Changes something.
        """
        return self._call("queue.move", {"run": run, "place": place, "if_rev": if_rev, "idem": idem})

    def pause(self, *, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Nothing more begins; the run under way goes on.

        if_rev: rev of the queue as you know it: refused (rev.changed) where it is another by now
        idem: key of this change: asked again, the first answer comes
        Result: rev, paused_by (null where it is not), runs, next (the place of the page that follows; null: none). Least
        role: operator. Changes something.
        """
        return self._call("queue.pause", {"if_rev": if_rev, "idem": idem})

    def remove(self, *, run: str, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Takes a run out of the queue.

        run: its name, "R-000318"
        if_rev: rev of the queue as you know it: refused (rev.changed) where it is another by now
        idem: key of this change: asked again, the first answer comes
        Result: rev, paused_by (null where it is not), runs, next (the place of the page that follows; null: none). Least
        role: operator. Changes something.
        """
        return self._call("queue.remove", {"run": run, "if_rev": if_rev, "idem": idem})

    def start(self, *, lease: str, if_rev: Optional[int] = None, idem: Optional[str] = None) -> JsonObject:
        """Lets the next run begin when the rig is free. A queue in which runs wait is paused after every end of a run but
        complete, after a restart and after a reset.

        lease: your lease of the rig
        if_rev: rev of the queue as you know it: refused (rev.changed) where it is another by now
        idem: key of this change: asked again, the first answer comes
        Result: rev, paused_by (null where it is not), runs, next (the place of the page that follows; null: none). Least
        role: operator. Changes something.
        """
        return self._call("queue.start", {"lease": lease, "if_rev": if_rev, "idem": idem})


class RecipeMethods:
    """Methods recipe.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def check(self, *, recipe: str, seed: Optional[int] = None, parameters: Optional[JsonObject] = None,
              content: Optional[JsonObject] = None) -> JsonObject:
        """Everything that would be refused, before anything moves.

        recipe: its name
        seed: in place of the recipe's
        parameters: values of the recipe's parameters by name; defaults where left out
        content: a recipe that is in no file yet, in place of that of the folder
        Result: ok, digest (of the resolved recipe), file_digest, parameters (as declared), plan (eta_s with the people_s that
        people need, asks, next_attention, envelope of each stage with its margin, data_bytes of the samples, bytes that must
        be free on the disk for them with what is kept in reserve), problems of the recipe, the rig file and the bench put
        together dry: file, where, message, expected, got, hint; warnings, disk_ok. Least role: observer.
        """
        return self._call("recipe.check", {"recipe": recipe, "seed": seed, "parameters": parameters, "content": content})

    def diff(self, *, recipe: str, other: str) -> JsonObject:
        """What differs between two recipes, by JSON pointer.

        recipe: its name, or a run's: then as that has it on record
        other: likewise
        Result: same (as written), same_campaign (planned on this rig, parameters by default; null where that cannot be said),
        count, differences: where, change, was, is; the first 1000. Least role: observer.
        """
        return self._call("recipe.diff", {"recipe": recipe, "other": other})

    def get(self, *, recipe: str) -> JsonObject:
        """A recipe of the daemon's folder as it is written.

        recipe: its name
        Result: recipe, text, content (the same as JSON; null where it is none), file_digest. Least role: observer.
        """
        return self._call("recipe.get", {"recipe": recipe})

    def list(self) -> JsonObject:
        """List the recipes of the daemon's folder.

        Result: recipes (names), parameters (by recipe, as it declares them; recipes with none are left out), descriptions (by
        recipe, likewise). Least role: observer.
        """
        return self._call("recipe.list", {})

    def plan(self, *, recipe: str, seed: Optional[int] = None, from_: Optional[int] = None, most: Optional[int] = None,
             parameters: Optional[JsonObject] = None) -> JsonObject:
        """What a recipe will do on this rig: phases, and each trial with its expected time.

        recipe: its name, or a run's: then as that has it on record
        seed: in place of the recipe's, or of the run's
        from_: the first trial that is told, 0
        most: trials, 100; at most 1000
        parameters: values of the recipe's parameters by name; defaults where left out
        Result: name, digest (of the resolved recipe), parameters (as declared), plan_digest, trials, duration_s, people_s,
        bytes, hand_over, explorations, steps, next. Least role: observer.
        """
        return self._call("recipe.plan", {"recipe": recipe, "seed": seed, "from": from_, "most": most, "parameters": parameters})

    def put(self, *, recipe: str, content: Optional[JsonObject] = None, text: Optional[str] = None, if_digest: Optional[str] = None,
            parameters: Optional[JsonObject] = None, idem: Optional[str] = None) -> JsonObject:
        """Puts a recipe that recipe.check accepts into the daemon's folder.

        recipe: its name
        content: the recipe; see recipe.schema
        text: the recipe as text, written as it is; in the place of content
        if_digest: file_digest of the one that it replaces; needed where there is one
        parameters: values to check it with, for parameters without default
        idem: key of this change: asked again, the first answer comes
        Result: recipe, digest, replaced (digest, or null), trials. Least role: engineer. Changes something.
        """
        return self._call("recipe.put", {"recipe": recipe, "content": content, "text": text, "if_digest": if_digest,
                                         "parameters": parameters, "idem": idem})

    def schema(self) -> JsonObject:
        """JSON Schema of a recipe.

        Result: a JSON Schema of draft 2020-12 with x-unit. Least role: observer.
        """
        return self._call("recipe.schema", {})


class RigMethods:
    """Methods rig.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def describe(self) -> JsonObject:
        """What the rig is and can do, as its file says.

        Result: rig, bench (simulated, emulated, real), simulated, wrench (false: no force sensor, and the caps are null),
        force_cap_n, torque_cap_nm, travel by axis, fixed: where axes without a stage stand; plate: origin, size, surface_z_m;
        footprint of the probe, clearance_m, taxels, taxel_shape (rows and columns, or places; null: not stated; of several
        arrays: arrays, each with device, taxels and shape), taxel_span_counts (full colour of a pad map; null: not stated),
        fabrics. Least role: observer.
        """
        return self._call("rig.describe", {})

    def estop(self, *, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """As rig.halt, and only an engineer resets it. It is a stop by software: no rig has a power path that it could cut.

        reason: a few words, for whoever resets it
        idem: key of this change: asked again, the first answer comes
        Result: latched, latch, warnings (what was wrong with the request, which was heeded all the same; only where there is
        some). Least role: observer. Changes something.
        """
        return self._call("rig.estop", {"reason": reason, "idem": idem})

    def halt(self, *, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Stops motion where it is and latches the rig, each time that it is asked for; needs no lease and no role, on the local
        socket no session.open.

        reason: a few words, for whoever resets it
        idem: key of this change: asked again, the first answer comes
        Result: latched, latch, warnings (what was wrong with the request, which was heeded all the same; only where there is
        some). Least role: observer. Changes something.
        """
        return self._call("rig.halt", {"reason": reason, "idem": idem})

    def jog(self, *, lease: str, axis: str, distance: float, idem: Optional[str] = None) -> JsonObject:
        """Move one axis by at most 5 mm or 1 degree, at a tenth of its speed, outside a run; every motion but z up stops where
        the force changes by 1 N; answers when the motion has ended.

        lease: your lease of the rig
        axis: x, y, z, rx or ry
        distance: [m], for rx and ry [rad]; z counts downwards
        idem: key of this change: asked again, the first answer comes
        Result: order, from, to (positions by axis), relative (z was not homed: it went up from where it was), outcome, rig
        (safe: the probe is up; holding; unknown), error. Least role: operator. Changes something.
        """
        return self._call("rig.jog", {"lease": lease, "axis": axis, "distance": distance, "idem": idem})

    def lock(self, *, reason: str, idem: Optional[str] = None) -> JsonObject:
        """Lock the rig out in your name: nothing moves, over restarts too, before rig.unlock.

        reason: what for, for the others
        idem: key of this change: asked again, the first answer comes
        Result: as rig.state. Least role: operator. Changes something.
        """
        return self._call("rig.lock", {"reason": reason, "idem": idem})

    def park(self, *, lease: str, idem: Optional[str] = None) -> JsonObject:
        """Lift the probe, then move x, y, rx and ry to the rig file's park position, outside a run; every stage must be homed;
        answers when the motion has ended.

        lease: your lease of the rig
        idem: key of this change: asked again, the first answer comes
        Result: order, from, to (positions by axis), relative (z was not homed: it went up from where it was), outcome, rig
        (safe: the probe is up; holding; unknown), error. Least role: operator. Changes something.
        """
        return self._call("rig.park", {"lease": lease, "idem": idem})

    def reset(self, *, reason: str, idem: Optional[str] = None) -> JsonObject:
        """Release the latch after looking at the rig; after an emergency stop an engineer does it. Nothing moves by it: the fact
        remains, and a queue in which runs wait is paused.

        reason: what was looked at
        idem: key of this change: asked again, the first answer comes
        Result: latched, and as rig.state. Least role: operator. Changes something.
        """
        return self._call("rig.reset", {"reason": reason, "idem": idem})

    def retract(self, *, lease: str, idem: Optional[str] = None) -> JsonObject:
        """Lift the probe to the clear height, outside a run and without homing; answers when the motion has ended. Where z has
        not been homed it goes up by at most the clearance from where it is.

        lease: your lease of the rig
        idem: key of this change: asked again, the first answer comes
        Result: order, from, to (positions by axis), relative (z was not homed: it went up from where it was), outcome, rig
        (safe: the probe is up; holding; unknown), error. Least role: operator. Changes something.
        """
        return self._call("rig.retract", {"lease": lease, "idem": idem})

    def state(self) -> JsonObject:
        """Whether the rig moves, where it was left, and what keeps it from moving.

        Result: rig (moving, holding, safe, unknown or latched), run, maintenance (retract, park or jog: what moves outside a
        run), fact (safe, holding or unknown: how the newest run left it), left_by, acknowledged (a person has reset it
        since), latch (halt or estop), latched_by (with the reason), locked: by, reason, since_us. Least role: observer.
        """
        return self._call("rig.state", {})

    def unlock(self, *, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Remove your lock-out, or as an engineer another person's with a reason.

        reason: for another person's
        idem: key of this change: asked again, the first answer comes
        Result: as rig.state. Least role: operator. Changes something.
        """
        return self._call("rig.unlock", {"reason": reason, "idem": idem})


class RpcMethods:
    """Methods rpc.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def discover(self) -> JsonObject:
        """This document.

        Result: OpenRPC. Least role: observer.
        """
        return self._call("rpc.discover", {})


class RunMethods:
    """Methods run.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def abort(self, *, run: str, break_lease: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Stops motion, retracts, ends.

        run: its name, "R-000318"
        break_lease: a reason: break the lease that another user has for this run (abort: operator, else engineer)
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.abort", {"run": run, "break_lease": break_lease, "idem": idem})

    def annotate(self, *, run: str, tags: Optional[List[Any]] = None, note: Optional[str] = None,
                 idem: Optional[str] = None) -> JsonObject:
        """Sets the tags or the note of a run, of any time; its data stay as they are. In the journal as kind "note".

        run: its name, "R-000318"
        tags: all of them: at most 16 texts of 40 characters
        note: at most 4000 characters
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.annotate", {"run": run, "tags": tags, "note": note, "idem": idem})

    def confirm(self, *, run: str, step: str, break_lease: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """A person has done what the run waits for, as its "attention" says; it goes on.

        run: its name, "R-000318"
        step: which one: step of the run's attention, "Q-12"
        break_lease: a reason: break the lease that another user has for this run (abort: operator, else engineer)
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.confirm", {"run": run, "step": step, "break_lease": break_lease, "idem": idem})

    def get(self, *, run: str) -> JsonObject:
        """One run.

        run: its name, "R-000318"
        Result: the run; submitted_by who put it in line, by who changed it last; attention is the next human action (null:
        none), next_attention_us since when it is asked or when it will be; campaign_since, where its campaign was gone on
        with without the daemon (weft run --resume): what its folder holds by now, trials_done, trials_planned, complete,
        dataset_sha256; promise, where an accuracy of the simulation was asked for: held; result, the accuracy of each
        exploration (null: not evaluated): exploration, learner, protocol, accuracy, ci95, tested, unit, labels, not_tested,
        base_rate, chance. Least role: observer.
        """
        return self._call("run.get", {"run": run})

    def list(self, *, state: Optional[str] = None, search: Optional[str] = None, from_: Optional[str] = None,
             most: Optional[int] = None, order: Optional[str] = None) -> JsonObject:
        """The runs, page by page.

        state: only those in this state
        search: only those in whose id, recipe, name, fabrics, tags, note or outcome it is, whatever the case of its letters a
            to z; at most 40 characters
        from_: this run on: next of the page before
        most: runs, 1000 at most, and no more than 1 MiB
        order: oldest (default) or newest first
        Result: runs, next (null where there is no more). Least role: observer.
        """
        return self._call("run.list", {"state": state, "search": search, "from": from_, "most": most, "order": order})

    def pause(self, *, run: str, at: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Holds before the next repetition, or now: then that repetition is run again; where no repetition is left, the queue is
        paused instead (pause_carried_over).

        run: its name, "R-000318"
        at: boundary (default) or now
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.pause", {"run": run, "at": at, "idem": idem})

    def recover(self, *, run: str, choice: str, preview: Optional[bool] = None, lease: Optional[str] = None,
                idem: Optional[str] = None) -> JsonObject:
        """Resume a run that was interrupted, stopped, aborted or failed with trials left, or discard it (it is never made a data
        set), or keep its complete trials as a data set.

        run: its name, "R-000318"
        choice: resume, discard or keep-partial
        preview: answers what it would do, and does nothing
        lease: of the rig; needed without preview
        idem: key of this change: asked again, the first answer comes
        Result: the run, or will, trials_planned, trials_done, trials_left. Least role: operator. Changes something.
        """
        return self._call("run.recover", {"run": run, "choice": choice, "preview": preview, "lease": lease, "idem": idem})

    def resume(self, *, run: str, preview: Optional[bool] = None, lease: Optional[str] = None, break_lease: Optional[str] = None,
               idem: Optional[str] = None) -> JsonObject:
        """Resume: up, position, bias, then the next repetition; a run that is over and can be recovered with the repetition that
        was cut short.

        run: its name, "R-000318"
        preview: runs that are over: answer what it would do, and do nothing
        lease: of the rig; runs that are over need it
        break_lease: a reason: break the lease that another user has for this run (abort: operator, else engineer)
        idem: key of this change: asked again, the first answer comes
        Result: the run, or will, trials_planned, trials_done, trials_left. Least role: operator. Changes something.
        """
        return self._call("run.resume", {"run": run, "preview": preview, "lease": lease, "break_lease": break_lease, "idem": idem})

    def samples(self, *, after_s: Optional[float] = None, most: Optional[int] = None) -> JsonObject:
        """The last 40 minutes, on the bench's clock, of what the newest run's bench sensed, to look at: also what nobody
        listened to, and once the run is over. No record.

        after_s: only what is newer, on the bench's clock [s]
        most: rows, 1500; at most 3000. Of more, neighbours are joined: the last of them with the extremes of all
        Result: run (null: none yet), columns, rows (values in the order of columns, null: not known), counts and rest_counts
        as in stream:taxels, the newest. Least role: observer.
        """
        return self._call("run.samples", {"after_s": after_s, "most": most})

    def start(self, *, recipe: str, lease: Optional[str] = None, seed: Optional[int] = None, name: Optional[str] = None,
              digest: Optional[str] = None, keep_going: Optional[bool] = None, repeat: Optional[int] = None,
              after: Optional[str] = None, parameters: Optional[JsonObject] = None, idem: Optional[str] = None) -> JsonObject:
        """Puts a campaign in line, with its recipe as it is now; it begins when the rig is free.

        recipe: name of a recipe, see recipe.list
        lease: your lease of the rig; not needed while another user's is kept for a run under way
        seed: in place of the recipe's
        name: added to the folder's name
        digest: of the resolved recipe that is meant, as recipe.check has it; another one is refused
        keep_going: let the next run begin also where this one is stopped, aborted or fails
        repeat: as many runs of it, 1 to 100; a seed counts up from one to the next; 1
        after: a run, "R-000317": begin once that one has ended complete; "" for none
        parameters: values of the recipe's parameters by name; defaults where left out
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.start", {"recipe": recipe, "lease": lease, "seed": seed, "name": name, "digest": digest,
                                        "keep_going": keep_going, "repeat": repeat, "after": after, "parameters": parameters,
                                        "idem": idem})

    def stop(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """Finishes the repetition, cleans up, ends.

        run: its name, "R-000318"
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.stop", {"run": run, "idem": idem})

    def wait(self, *, run: str, hand_over: Optional[bool] = None) -> JsonObject:
        """Answers when the run has ended.

        run: its name, "R-000318"
        hand_over: and what its recipe hands over as well
        Result: the run. Least role: observer.
        """
        return self._call("run.wait", {"run": run, "hand_over": hand_over})

    def withdraw(self, *, run: str, idem: Optional[str] = None) -> JsonObject:
        """Takes a run out of the queue: the old name of queue.remove, kept for one version.

        run: its name, "R-000318"
        idem: key of this change: asked again, the first answer comes
        Result: the run. Least role: operator. Changes something.
        """
        return self._call("run.withdraw", {"run": run, "idem": idem})


class SessionMethods:
    """Methods session.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def close(self, *, session: Optional[str] = None, reason: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Ends a session once its answer is sent: your own, or an admin another's with a reason; what it has started goes on,
        and its leases until their time is over.

        session: its name, "s-41"; yours
        reason: for who is there and for the journal
        idem: key of this change: asked again, the first answer comes
        Result: closed. Least role: observer. Changes something.
        """
        return self._call("session.close", {"session": session, "reason": reason, "idem": idem})

    def list(self) -> JsonObject:
        """Who is connected and has introduced himself.

        Result: sessions: session, user, client, role, local (through the Unix socket), subscriptions, waiting_calls. Least
        role: observer.
        """
        return self._call("session.list", {})

    def open(self, *, client: str, version: Optional[str] = None, protocol: Optional[str] = None, token: Optional[str] = None,
             want: Optional[List[Any]] = None) -> JsonObject:
        """Introduces the client and settles protocol and role; the first request.

        client: name of the program
        version: of the program
        protocol: wanted, "1.x"
        token: where the peer's credentials do not do
        want: features; those of them that there are come back, all where it is left out
        Result: session, user (with a token: as token.add says), role, protocol, features, epoch, seq, ready. Least role:
        observer.
        """
        return self._call("session.open", {"client": client, "version": version, "protocol": protocol, "token": token,
                                           "want": want})

    def whoami(self) -> JsonObject:
        """Who you are here.

        Result: session, client, user, role. Least role: observer.
        """
        return self._call("session.whoami", {})


class SimMethods:
    """Methods sim.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def clear(self, *, device: str, fault: Optional[str] = None, idem: Optional[str] = None) -> JsonObject:
        """Ends such faults of a device, also those of its rig file.

        device: its name, see device.list
        fault: its kind; all where it is left out
        idem: key of this change: asked again, the first answer comes
        Result: device, fault, run. Least role: engineer. Changes something.
        """
        return self._call("sim.clear", {"device": device, "fault": fault, "idem": idem})

    def clock(self, *, pace: float, idem: Optional[str] = None) -> JsonObject:
        """How fast the time of a simulated bench passes, now and in later runs; the daemon begins with --pace.

        pace: bench seconds per second, 1 to 1000000; 0: as fast as it can
        idem: key of this change: asked again, the first answer comes
        Result: pace. Least role: operator. Changes something.
        """
        return self._call("sim.clock", {"pace": pace, "idem": idem})

    def inject(self, *, device: str, fault: str, start_s: Optional[float] = None, duration_s: Optional[float] = None,
               probability: Optional[float] = None, amount: Optional[float] = None, towards: Optional[str] = None,
               idem: Optional[str] = None) -> JsonObject:
        """Lets a fault befall a device of the simulated or emulated bench of the run under way, once its devices are up; kinds:
        docs/reference/faults.md.

        device: its name, see device.list
        fault: its kind, "drop"
        start_s: from now, on the bench's clock [s], 0
        duration_s: [s]; for ever where it is left out
        probability: 0 to 1 of each message or reading, 1
        amount: how much, in the unit of the kind
        towards: host (default) or device, of faults of the wire
        idem: key of this change: asked again, the first answer comes
        Result: the fault, run. Least role: engineer. Changes something.
        """
        return self._call("sim.inject", {"device": device, "fault": fault, "start_s": start_s, "duration_s": duration_s,
                                         "probability": probability, "amount": amount, "towards": towards, "idem": idem})


class SubMethods:
    """Methods sub.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def close(self, *, sub: str) -> JsonObject:
        """No more of it.

        sub: its name, "u3"
        Result: closed. Least role: observer.
        """
        return self._call("sub.close", {"sub": sub})

    def credit(self, *, sub: str, events: int) -> JsonObject:
        """Lets a subscription that was opened with credit send more events.

        sub: its name, "u3"
        events: so many more, 1 to 1000000
        Result: sub, credit. Least role: observer.
        """
        return self._call("sub.credit", {"sub": sub, "events": events})

    def open(self, *, topics: List[Any], mode: Optional[str] = None, max_hz: Optional[float] = None, credit: Optional[int] = None,
             from_seq: Optional[int] = None, epoch: Optional[str] = None) -> JsonObject:
        """Events from now on: a snapshot, then what changes.

        topics: "run:R-000318"; "run:*" for all of a kind
        mode: latest (merged) or every (bounded, gaps told)
        max_hz: of latest, 20 [Hz]
        credit: so many events, and no more before sub.credit; what waits longer than the bound is a gap that is told
        from_seq: all events after this one instead
        epoch: of the daemon that numbered from_seq
        Result: sub, seq, snapshot (by topic, at most 1 MiB), left_off (so many topics had no room in it: those that changed
        longest ago; ask for them by name, or run.list). Least role: observer.
        """
        return self._call("sub.open", {"topics": topics, "mode": mode, "max_hz": max_hz, "credit": credit, "from_seq": from_seq,
                                       "epoch": epoch})


class SystemMethods:
    """Methods system.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def info(self) -> JsonObject:
        """What runs here.

        Result: product, version, rig, bench ("simulated" or "real"), pace, http (null where it is not served), epoch, seq.
        Least role: observer.
        """
        return self._call("system.info", {})

    def metrics(self) -> JsonObject:
        """How much there is of what grows or runs out.

        Result: up_s, seq (events told), listeners, leases, queued, runs by state, disk_free_bytes (null where that is not
        known). Least role: observer.
        """
        return self._call("system.metrics", {})

    def ready(self) -> JsonObject:
        """Whether a run can be started, and all that keeps it from that.

        Result: ok, blockers. Least role: observer.
        """
        return self._call("system.ready", {})

    def time(self) -> JsonObject:
        """Both clocks.

        Result: t_us (UTC), mono_us. Least role: observer.
        """
        return self._call("system.time", {})


class TokenMethods:
    """Methods token.*"""

    def __init__(self, call: Call) -> None:
        self._call = call

    def add(self, *, name: str, role: Optional[str] = None, days: Optional[int] = None, own: Optional[bool] = None,
            idem: Optional[str] = None) -> JsonObject:
        """Makes a token for TCP and HTTP; it is told once, here.

        name: whom it is for, a new name
        role: observer, operator (default), engineer or admin
        days: how long it is good for [days], 30
        own: it is for yourself, a user of the machine, who came without a token: who comes with it is you, as far as its role
            goes, and has your leases and keys; else token:NAME
        idem: key of this change: asked again, the first answer comes
        Result: name, role, expires_us, user (who comes with it), token. Least role: admin. Changes something.
        """
        return self._call("token.add", {"name": name, "role": role, "days": days, "own": own, "idem": idem})


class Api:
    """All of them, by noun: api.run.start(recipe="m1", lease="L-1")."""

    def __init__(self, call: Call) -> None:
        self.classify = ClassifyMethods(call)
        self.data = DataMethods(call)
        self.device = DeviceMethods(call)
        self.handover = HandoverMethods(call)
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

#!/usr/bin/env python3
"""weft_client.bluesky with the real bluesky and ophyd-async, from PyPI at pinned versions (bluesky_rig.txt), against weftd on the simulated rig: a campaign
is flown, the probe is moved within its limits, plans are paused, resumed and aborted, also during kickoff and when answers are lost.

    bluesky_rig.py WEFTD SOURCE_ROOT FOLDER      FOLDER has the virtual environment, and is made if it does not exist

Exit 77 (skipped) if PyPI cannot be reached or is too slow. All simulated.
"""
import asyncio
import concurrent.futures
import contextlib
import json
import logging
import pathlib
import sys
import tempfile
import threading
import time

import pypi_environment

WEFTD, ROOT = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()

if __name__ == "__main__":
    pypi_environment.enter(sys.argv[3], pathlib.Path(__file__).with_suffix(".txt"))

sys.path.insert(0, str(ROOT / "clients/python/src"))

import bluesky.plan_stubs as bps
import bluesky.preprocessors as bpp
from bluesky import RunEngine
from bluesky.plans import count, scan
from bluesky.utils import FailedStatus, RunEngineInterrupted

import weft_client
from cli_support import Checks
from weft_client.bluesky import WeftCampaign, WeftRig, fly_recipe
from weftd_support import Daemon

TRIALS = 8
CLEAR_Z_MM, NEAR_MM = 52, 0.02  # bench17: plate at 60 mm, clearance 8 mm
PATIENCE_S = 60


class Documents:
    def __init__(self, engine):
        self.all = []
        engine.subscribe(lambda name, document: self.all.append((name, document)))

    def take(self):
        """The documents since the last call, by name; pages of events as rows by the name of their stream."""
        taken, self.all = self.all, []
        found, streams, rows = {}, {}, {}
        for name, document in taken:
            found.setdefault(name, []).append(document)
            if name == "descriptor":
                streams[document["uid"]] = document["name"]
            elif name == "event":
                rows.setdefault(streams[document["descriptor"]], []).append(document["data"])
            elif name == "event_page":
                data = document["data"]
                rows.setdefault(streams[document["descriptor"]], []).extend(dict(zip(data, row)) for row in zip(*data.values()))
        return found, rows


def until(condition, what):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, f"not within {PATIENCE_S} s: {what}"
        time.sleep(0.02)


def lines(client, kind):
    return client.api.log.query(kind=kind, most=1000)["lines"]


def is_safe_and_free(t, client, what):
    state = client.api.rig.state()
    t.expect(state["rig"] == "safe" and "maintenance" not in state, f"{what}: {state}")
    t.expect(client.api.lease.list()["leases"] == [], f"{what}: {client.api.lease.list()}")


def refused(t, engine, plan, kind, what):
    try:
        engine(plan)
        t.expect(False, f"{what}: not refused")
    except (weft_client.WeftError, FailedStatus) as problem:
        cause = problem if isinstance(problem, weft_client.WeftError) else problem.__cause__ or problem.args[0].exception()
        t.expect(getattr(cause, "kind", "") == kind, f"{what}: {cause!r}")


def before_homing(t, client, engine, rig):
    refused(t, engine, scan([rig.z], rig.x, 70, 72, 2), "state.conflict", "stages not homed")
    refused(t, engine, count([rig.wrench]), "state.conflict", "no sample without a run")
    t.expect(all(line["data"]["state"] != "moving" for line in lines(client, "maintenance")), "nothing moved before the first run")
    t.expect(client.api.lease.list()["leases"] == [], "no lease after a refused plan")


def flies(t, client, engine, rig, documents):
    """A whole campaign. Its documents have the digests of the certificate."""
    campaign = WeftCampaign(rig, "small", seed=5)
    engine(fly_recipe(campaign, md={"purpose": "smoke"}))
    found, rows = documents.take()
    certificate = client.api.data.certificate(run=campaign.run.name)
    start, stop, summary = found["start"][0], found["stop"][0], rows["campaign"]
    t.expect(start["weft"]["simulated"] is True and start["weft"]["bench"] == "simulated" and start["weft"]["rig"] == "bench17", f"{start}")
    t.expect((start["recipe"], start["purpose"], stop["exit_status"]) == ("small", "smoke", "success"), f"{start} {stop}")
    t.expect(stop["num_events"] == {"campaign-trials": TRIALS, "campaign": 1}, f"{stop}")
    t.expect(len(summary) == 1 and len(certificate["dataset_sha256"]) == 64, f"{summary} {certificate['dataset_sha256']}")
    expected = {"run": campaign.run.name, "dataset_sha256": certificate["dataset_sha256"], "recipe_digest": campaign.run.state()["digest"], "simulated": True,
                "outcome": "complete", "cleanup": "done", "rig": "safe", "trials_done": TRIALS, "trials_planned": TRIALS}
    t.expect({key: summary[0][f"campaign-{key}"] for key in expected} == expected, f"{summary} for {expected}")
    accuracies = [result["accuracy"] for result in campaign.run.state()["result"]]
    t.expect(len(accuracies) == 1 and summary[0]["campaign-accuracy"] == accuracies[0] > 0.5, f"{summary} for {accuracies}")
    trials = [(row["campaign-trials-trial"], row["campaign-trials-sha256"]) for row in rows["campaign-trials"]]
    t.expect(trials == [(trial["name"], trial["sha256"]) for trial in certificate["trials"]] and all(digest for _, digest in trials), f"{trials}")
    t.expect(all(row["campaign-trials-simulated"] is True and row["campaign-trials-dataset_sha256"] == certificate["dataset_sha256"]
                 and 0 < row["campaign-trials-force_rms_error_n"] < 0.1 for row in rows["campaign-trials"]), f"{rows['campaign-trials']}")
    is_safe_and_free(t, client, "after a flight")
    refused(t, engine, count([rig.wrench]), "state.conflict", "the last sample of a run that is over")
    refused(t, engine, count([rig.taxels]), "state.conflict", "the last frame of a run that is over")
    print(f"SIMULATED campaign {campaign.run.name}: {TRIALS} trials, accuracy {accuracies[0]}, data set {certificate['dataset_sha256'][:12]}")
    return campaign.run.name


def moves(t, client, engine, rig, documents, run):
    """A scan of two axes with wrench and taxels of the newest run; the journal has the motions."""
    documents.take()
    before = len(lines(client, "maintenance"))
    engine(scan([rig.wrench, rig.taxels, rig.z], rig.x, 74, 78, rig.rx, 0, 1, num=3, md=rig.metadata()))
    found, rows = documents.take()
    events = rows["primary"]
    t.expect([round(event["rig-x"], 1) for event in events] == [74, 76, 78], f"{events}")
    t.expect(all(abs(event["rig-x"] - mm) < NEAR_MM and abs(event["rig-rx"] - deg) < NEAR_MM and abs(event["rig-z"] - CLEAR_Z_MM) < 2 * NEAR_MM
                 for event, mm, deg in zip(events, (74, 76, 78), (0, 0.5, 1))), f"{events}")
    t.expect(all(len(event["rig-taxels"]) == 16 and min(event["rig-taxels"]) > 0 and abs(event["rig-wrench-fz_n"]) < 1 for event in events), f"{events}")
    t.expect(all((event["rig-wrench-live"], event["rig-wrench-run"], event["rig-wrench-simulated"]) == (False, run, True) for event in events), f"{events}")
    configuration = found["descriptor"][0]["configuration"]
    t.expect(configuration["rig-x"]["data"]["rig-x-simulated"] is True and configuration["rig-x"]["data"]["rig-x-high"] == 150, f"{configuration}")
    t.expect(found["start"][0]["weft"]["simulated"] is True, f"{found['start']}")
    ended = [line["data"] for line in lines(client, "maintenance")[before:] if line["data"]["state"] == "ended"]
    t.expect(len(ended) >= 8 and all(line["order"] in ("jog", "retract") and line["outcome"] == "complete" for line in ended), f"{ended}")
    is_safe_and_free(t, client, "after a scan")
    engine(bpp.stage_wrapper(bps.mv(rig.z, CLEAR_Z_MM + 2), [rig]))
    t.expect(abs(lines(client, "maintenance")[-1]["data"]["to"]["z_m"] - CLEAR_Z_MM / 1000) < 1e-4, "unstage() lifts a lowered probe")
    is_safe_and_free(t, client, "after a lowered probe")


def limits(t, client, engine, rig):
    """Beyond a limit: refused before motion. Without stage(): no lease, no motion."""
    for stage, target in (rig.x, 150.01), (rig.z, -0.1), (rig.rx, 5.01), (rig.ry, float("nan")):
        def plan():
            nonlocal before
            before = len(lines(client, "maintenance"))
            yield from bps.mv(stage, target)
        before = 0
        refused(t, engine, bpp.stage_wrapper(plan(), [rig]), "param.range", f"{stage.name} to {target}")
        t.expect(len(lines(client, "maintenance")) == before > 0, f"{stage.name} to {target}: no motion")
    before = len(lines(client, "maintenance"))
    refused(t, engine, bps.mv(rig.x, 75), "state.conflict", "not staged")

    def unstaged():
        yield from bps.open_run()
        yield from bps.kickoff(WeftCampaign(rig, "small"), wait=True)
    runs = len(client.runs())
    refused(t, engine, unstaged(), "state.conflict", "nothing staged")
    t.expect(len(lines(client, "maintenance")) == before, "nothing moved without stage()")
    refused(t, engine, bpp.stage_wrapper(unstaged(), [rig]), "state.conflict", "campaign not staged")
    t.expect(len(client.runs()) == runs, "nothing started without stage()")
    is_safe_and_free(t, client, "after refusals")


def in_background(action, condition, what):
    """`action` in a thread as soon as `condition` holds."""
    def act():
        until(condition, what)
        action()
    thread = threading.Thread(target=act, daemon=True)
    thread.start()
    return thread


def interrupted(t, engine, plan, what):
    try:
        engine(plan)
        t.expect(False, f"{what}: not interrupted")
    except RunEngineInterrupted:
        pass


def step_of(campaign):
    return (campaign.run.state().get("at") or {}).get("step") if campaign.run else None


def pauses_a_move(t, client, engine, rig):
    """A pause ends the move after its present jog, and nothing moves meanwhile; the resume completes it."""
    client.api.sim.clock(pace=4)
    places = []

    def plan():
        yield from bps.mv(rig.x, 78)
        yield from bps.checkpoint()
        yield from bps.mv(rig.x, 84)
        places.append((yield from bps.rd(rig.x)))
    first = len(lines(client, "maintenance"))
    beyond = lambda: any(line["data"].get("to", {}).get("x_m", 0) > 0.0789 for line in lines(client, "maintenance")[first:])
    pausing = in_background(engine.request_pause, beyond, "x beyond 78.9 mm")
    interrupted(t, engine, bpp.stage_wrapper(plan(), [rig]), "pause of a move")
    pausing.join(PATIENCE_S)
    held = lines(client, "maintenance")
    t.expect(held[-1]["data"]["state"] == "ended" and 0.0785 < held[-1]["data"]["to"]["x_m"] < 0.0835, f"{held[-1]}")
    t.expect(client.api.rig.state()["rig"] == "safe" and len(client.api.lease.list()["leases"]) == 1, "safe and leased during the pause")
    time.sleep(0.5)
    t.expect(len(lines(client, "maintenance")) == len(held), "no motion during a pause")
    client.api.sim.clock(pace=0)
    engine.resume()
    t.expect(len(places) == 1 and abs(places[0] - 84) < NEAR_MM, f"{places}")
    is_safe_and_free(t, client, "after a resumed move")


def pauses_a_flight(t, client, engine, rig, documents):
    """A pause retracts the probe and holds the run; the resumed campaign is complete. Sensors are live during the flight."""
    client.api.sim.clock(pace=20)
    live = WeftRig(client, "live")
    campaign = WeftCampaign(rig, "small", seed=6)
    documents.take()
    pausing = in_background(engine.request_pause, lambda: step_of(campaign) == "sliding", "a slide")
    interrupted(t, engine, fly_recipe(campaign), "pause of a flight")
    pausing.join(PATIENCE_S)
    run = campaign.run.name
    t.expect(campaign.run.state()["state"] == "held", f"{campaign.run.state()}")
    last = [line["data"] for line in lines(client, "state") if line["run"] == run]
    time.sleep(0.5)
    t.expect(last == [line["data"] for line in lines(client, "state") if line["run"] == run], "the run stays held during a pause")
    samples = client.api.run.samples(most=1)
    t.expect(dict(zip(samples["columns"], samples["rows"][-1]))["z_mm"] < CLEAR_Z_MM + 0.5, f"the probe is lifted: {samples['rows']}")
    readings = engine_read(engine, live.wrench)
    t.expect(readings["live-wrench-live"] is True and readings["live-wrench-run"] == run, f"{readings}")
    client.api.sim.clock(pace=0)
    engine.resume()
    found, rows = documents.take()
    t.expect(len(rows["campaign"]) == 1 and rows["campaign"][0]["campaign-outcome"] == "complete" and rows["campaign"][0]["campaign-run"] == run, f"{rows}")
    outcomes = [row["campaign-trials-outcome"] for row in rows["campaign-trials"]]
    t.expect(outcomes.count("complete") == TRIALS and len(outcomes) == TRIALS + 1, f"one repeated attempt: {outcomes}")
    t.expect(found["stop"][0]["exit_status"] == "success", f"{found['stop']}")
    is_safe_and_free(t, client, "after a resumed flight")


def engine_read(engine, sensor):
    """A reading on the loop of a paused engine."""
    values = asyncio.run_coroutine_threadsafe(sensor.read(), engine.loop).result(PATIENCE_S)
    return {key: reading["value"] for key, reading in values.items()}


def aborts(t, client, engine, rig, documents, how):
    """The RunEngine is aborted while the probe slides: the run is aborted, the probe lifted, the lease released, and the documents have the run."""
    client.api.sim.clock(pace=20)
    documents.take()
    campaign = WeftCampaign(rig, "small", seed=7)
    plan = {"bare": lambda: bare(campaign), "bare, rig": lambda: bare(campaign, rig)}.get(how, lambda: fly_recipe(campaign))()
    sliding = lambda: step_of(campaign) == "sliding"
    acting = in_background(engine.request_pause if how == "paused" else lambda: engine.abort("smoke"), sliding, "a slide")
    interrupted(t, engine, plan, f"abort ({how})")
    if how == "paused":
        engine.abort("smoke")
    acting.join(PATIENCE_S)
    client.api.sim.clock(pace=0)
    until(lambda: client.api.lease.list()["leases"] == [], "lease released")
    end = campaign.run.wait(PATIENCE_S)
    t.expect((end.outcome, end.cleanup, end.rig) == ("aborted", "done", "safe"), f"{how}: {end}")
    is_safe_and_free(t, client, f"after an abort ({how})")
    found, rows = documents.take()
    t.expect(found["stop"][0]["exit_status"] == "abort", f"{how}: {found['stop']}")
    if not how.startswith("bare"):
        values = rows["campaign"][0]
        t.expect((values["campaign-outcome"], values["campaign-rig"], values["campaign-simulated"], values["campaign-run"])
                 == ("aborted", "safe", True, campaign.run.name), f"{how}: {rows}")
    print(f"SIMULATED abort ({how}): {end.outcome}, {end.cleanup}, rig {end.rig}")


def bare(campaign, *more):
    """Without the clean-up of fly_recipe(): only the RunEngine's own unstage() is left."""
    yield from bps.open_run()
    for device in (*more, campaign):
        yield from bps.stage(device, wait=True)
    yield from bps.kickoff(campaign, wait=True)
    yield from bps.complete(campaign, wait=True)


@contextlib.contextmanager
def altered(client, method, change):
    """client.request, with `change(send, count)` in place of requests of `method`: `send()` sends it, `count` is the number of earlier ones. Lists them."""
    original, asked = client.request, []

    def request(name, params):
        if name != method:
            return original(name, params)
        asked.append(dict(params))
        return change(lambda: original(name, params), len(asked) - 1)
    client.request = request
    try:
        yield asked
    finally:
        client.request = original


def lost(answer=None):
    """A future of a lost answer, after `answer` has arrived if it is given."""
    if answer is not None:
        answer.result(PATIENCE_S)
    failed = concurrent.futures.Future()
    failed.set_exception(weft_client.ConnectionLost("answer lost (test)"))
    return failed


def first_lost(executed):
    """Loses the first answer, of a request that was executed or not."""
    return lambda send, count: send() if count else lost(send() if executed else None)


def delayed(delay_s):
    """Delays each answer."""
    def change(send, count):
        late, answer = concurrent.futures.Future(), send()
        answer.add_done_callback(lambda done: threading.Timer(delay_s, lambda: late.set_result(done.result())).start())
        return late
    return change


def is_aborted(t, client, run, what):
    """The end of the run by its own, without an order of this test."""
    until(lambda: client.api.lease.list()["leases"] == [], "lease released")
    state = client.api.run.get(run=run)
    ended = state["state"] == "ended"
    t.expect(ended and (state["outcome"], state["rig"]) == ("aborted", "safe"), f"{what}: {state['state']}, {state.get('outcome')}")
    if not ended:
        client.run(run).abort()
        client.run(run).wait(PATIENCE_S)
    is_safe_and_free(t, client, what)


def new_runs(client, before):
    return [run.name for run in client.runs()][before:]


def aborts_in_kickoff(t, client, engine, rig, documents, how):
    """An abort between run.start and its answer, and between recipe.check and run.start."""
    client.api.sim.clock(pace=20)
    campaign, before = WeftCampaign(rig, "small", seed=8), len(client.runs())
    method = "recipe.check" if how == "check" else "run.start"
    plan = bare(campaign, rig) if how == "bare" else fly_recipe(campaign)
    on_loop = lambda work: asyncio.run_coroutine_threadsafe(work, engine.loop).result(PATIENCE_S)
    on_loop(rig._bench.acquire_lease())  # else the lease, released by unstage(), would stop a late run.start
    with altered(client, method, delayed(0.7)) as asked:
        acting = in_background(lambda: engine.abort("smoke"), lambda: asked, method)
        interrupted(t, engine, plan, f"abort in kickoff ({how})")
        acting.join(PATIENCE_S)
        time.sleep(0.8)  # longer than the answer is delayed
        on_loop(rig._bench.release_lease())
    runs = new_runs(client, before)
    t.expect(len(runs) == (0 if how == "check" else 1), f"abort in kickoff ({how}): {runs}")
    for run in runs:
        is_aborted(t, client, run, f"abort in kickoff ({how})")
    is_safe_and_free(t, client, f"after an abort in kickoff ({how})")
    client.api.sim.clock(pace=0)


def pauses_in_kickoff(t, client, engine, rig, documents, method):
    """A pause before the answer of run.start holds the run; one before run.start delays it until the resume."""
    client.api.sim.clock(pace=20)
    campaign, before = WeftCampaign(rig, "small", seed=9), len(client.runs())
    documents.take()
    with altered(client, method, delayed(0.7)) as asked:
        pausing = in_background(engine.request_pause, lambda: asked, method)
        interrupted(t, engine, fly_recipe(campaign), f"pause in kickoff ({method})")
        pausing.join(PATIENCE_S)
        time.sleep(1)
    states = [client.api.run.get(run=run)["state"] for run in new_runs(client, before)]
    t.expect(states == (["held"] if method == "run.start" else []), f"pause in kickoff ({method}): {states}")
    client.api.sim.clock(pace=0)
    engine.resume()
    _, rows = documents.take()
    t.expect([row["campaign-outcome"] for row in rows["campaign"]] == ["complete"], f"pause in kickoff ({method}): {rows.get('campaign')}")
    t.expect(len(new_runs(client, before)) == 1, f"pause in kickoff ({method}): {new_runs(client, before)}")
    is_safe_and_free(t, client, f"after a pause in kickoff ({method})")


def loses_start(t, client, engine, rig, documents):
    """The answer of run.start is lost: the repeated request finds the run, and nothing is started twice."""
    campaign, before = WeftCampaign(rig, "small", seed=10), len(client.runs())
    documents.take()
    with altered(client, "run.start", first_lost(executed=True)) as asked, altered(client, "data.trials", first_lost(executed=True)):
        with contextlib.suppress(FailedStatus, weft_client.WeftError):
            engine(fly_recipe(campaign))
    _, rows = documents.take()
    t.expect(len(rows.get("campaign-trials", [])) == TRIALS and len(rows.get("campaign", [])) == 1, f"documents after a lost answer: {rows}")
    runs = new_runs(client, before)
    t.expect(len(runs) == 1 and campaign.run is not None and campaign.run.name == runs[0] and campaign.end.outcome == "complete", f"{runs} {campaign.run}")
    t.expect(len(asked) == 2 and asked[0]["idem"] == asked[1]["idem"], f"{asked}")
    for run in runs:
        client.run(run).wait(PATIENCE_S)
    is_safe_and_free(t, client, "after a lost answer of run.start")


def loses_start_in_abort(t, client, engine, rig, documents, executed):
    """run.start is lost, and the plan aborted before it is repeated: the repetition starts nothing, and finds what was started."""
    client.api.sim.clock(pace=20)
    campaign, before = WeftCampaign(rig, "small", seed=11), len(client.runs())

    def change(send, count):
        if count == 0:
            lose = lost(send() if executed else None)
            engine.abort("smoke")
            return lose
        return send()
    with altered(client, "run.start", change):
        with contextlib.suppress(FailedStatus, weft_client.WeftError, RunEngineInterrupted):
            engine(fly_recipe(campaign))
        until(lambda: client.api.lease.list()["leases"] == [], "lease released")
    runs = new_runs(client, before)
    t.expect(len(runs) == (1 if executed else 0), f"start lost in an abort, executed {executed}: {runs}")
    for run in runs:
        is_aborted(t, client, run, f"start lost in an abort, executed {executed}")
    is_safe_and_free(t, client, "after a start lost in an abort")
    client.api.sim.clock(pace=0)


def loses_abort(t, client, engine, rig, documents, executed):
    """The first run.abort of unstage() is lost: it is repeated before the lease is released."""
    client.api.sim.clock(pace=20)
    campaign = WeftCampaign(rig, "small", seed=12)
    with altered(client, "run.abort", first_lost(executed)) as asked:
        acting = in_background(lambda: engine.abort("smoke"), lambda: step_of(campaign) == "sliding", "a slide")
        with contextlib.suppress(FailedStatus):
            interrupted(t, engine, fly_recipe(campaign), "lost abort")
        acting.join(PATIENCE_S)
        until(lambda: client.api.lease.list()["leases"] == [], "lease released")
    t.expect(len(asked) == 2, f"run.abort sent {len(asked)} times")
    is_aborted(t, client, campaign.run.name, f"run.abort lost, executed {executed}")
    client.api.sim.clock(pace=0)


def loses_stop(t, client, engine, rig, documents):
    """stop() repeats its order after a lost connection."""
    client.api.sim.clock(pace=20)
    campaign = WeftCampaign(rig, "small", seed=13)
    with altered(client, "run.abort", first_lost(False)):
        def stop():
            with contextlib.suppress(weft_client.WeftError):
                asyncio.run_coroutine_threadsafe(campaign.stop(success=False), engine.loop).result(PATIENCE_S)
            acted.append(client.api.run.get(run=campaign.run.name)["state"])
            client.api.sim.clock(pace=0)
        acted = []
        acting = in_background(stop, lambda: step_of(campaign) == "sliding", "a slide")
        engine(fly_recipe(campaign))
        acting.join(PATIENCE_S)
    t.expect(campaign.end.outcome == "aborted", f"stop() with a lost order: {campaign.end} {acted}")
    is_safe_and_free(t, client, "after a lost order of stop()")


def loses_jog(t, client, engine, rig):
    """The answer of a jog is lost after it was executed: the position is not known, and the repeated move does not go too deep."""
    read, first = [], len(lines(client, "maintenance"))

    def plan():
        with altered(client, "rig.jog", first_lost(executed=True)):
            try:
                yield from bps.mv(rig.z, CLEAR_Z_MM + 1)
            except FailedStatus:
                pass
            read.append(rig._bench.last_positions)
            yield from bps.mv(rig.z, CLEAR_Z_MM + 1)
        read.append((yield from bps.rd(rig.z)))
    engine(bpp.stage_wrapper(plan(), [rig]))
    deepest = max(line["data"]["to"]["z_m"] for line in lines(client, "maintenance")[first:] if "to" in line["data"])
    t.expect(read[0] is None and abs(read[1] - CLEAR_Z_MM - 1) < 2 * NEAR_MM, f"{read}")
    t.expect(deepest < (CLEAR_Z_MM + 1 + 2 * NEAR_MM) / 1000, f"one step too deep: {deepest} m")
    is_safe_and_free(t, client, "after a lost answer of a jog")


def lifts_at_once(t, client, engine, rig):
    """unstage() sends rig.retract before it returns, once; a lost answer of it is no failure."""
    async def lower_and_unstage():
        await rig.stage()
        await rig.z.set(CLEAR_Z_MM + 1)
        status = rig.unstage()
        sent = len(asked)
        await status
        return sent
    for change in (lambda send, count: send()), first_lost(True), first_lost(False):
        with altered(client, "rig.retract", change) as asked:
            try:
                sent = asyncio.run_coroutine_threadsafe(lower_and_unstage(), engine.loop).result(PATIENCE_S)
            except weft_client.WeftError as problem:
                sent = problem
        t.expect(sent == 1, f"rig.retract sent before unstage() returns: {sent}")
        is_safe_and_free(t, client, "after unstage() with a lowered probe")


def ends_a_move(t, client, engine, rig, how):
    """The plan ends early while z moves down: the move ends, the probe is lifted, the lease released."""
    client.api.sim.clock(pace=4)
    first = len(lines(client, "maintenance"))
    motions = lambda: [line["data"] for line in lines(client, "maintenance")[first:] if "to" in line["data"]]
    lowered = lambda: any(motion["to"]["z_m"] > (CLEAR_Z_MM + 0.9) / 1000 for motion in motions())

    def plan():
        yield from bps.stage(rig, wait=True)
        yield from bps.abs_set(rig.z, CLEAR_Z_MM + 5, group="down")
        while how == "fail":
            yield from bps.sleep(0.02)
            if lowered():
                raise ValueError("failure of the plan (test)")
        yield from bps.wait("down")
    acting = in_background({"abort": lambda: engine.abort("smoke"), "halt": engine.halt}.get(how, lambda: None), lowered, "z lowered")
    with altered(client, "rig.jog", lambda send, count: [send(), lost()][1] if (how, count) == ("lost", 1) else send()):
        try:
            engine(plan())
            t.expect(False, f"{how} of a move: no exception")
        except (RunEngineInterrupted, ValueError, FailedStatus) as problem:
            expected = {"fail": ValueError, "lost": FailedStatus}.get(how, RunEngineInterrupted)
            t.expect(isinstance(problem, expected), f"{how} of a move: {problem!r}")
        acting.join(PATIENCE_S)
        client.api.sim.clock(pace=0)
        until(lambda: client.api.lease.list()["leases"] == [], "lease released")
    deepest = max(motion["to"]["z_m"] for motion in motions())
    t.expect(0.9 < deepest * 1000 - CLEAR_Z_MM < 4, f"{how} of a move: down to {deepest} m")
    t.expect(motions()[-1]["order"] == "retract" and motions()[-1]["outcome"] == "complete", f"{how} of a move: {motions()[-1]}")
    is_safe_and_free(t, client, f"after a move ({how})")


def write_recipes(folder):
    (folder / "recipes").mkdir()
    recipe = json.loads((ROOT / "recipes/library/first.json").read_text())
    recipe.pop("$schema")
    recipe.update(fabrics=["denim", "silk"], repetitions=TRIALS // 2, hand_over={"learner": "lda", "groups": 2})
    (folder / "recipes/small.json").write_text(json.dumps(recipe))


def main():
    t = Checks("weft")
    with tempfile.TemporaryDirectory(prefix="weft-bluesky-") as name:
        folder = pathlib.Path(name)
        write_recipes(folder)
        daemon = Daemon(WEFTD, ROOT, folder)
        try:
            with weft_client.connect(daemon.socket) as client:
                engine = RunEngine()
                engine.log.setLevel(logging.CRITICAL)
                documents = Documents(engine)
                rig = WeftRig(client)
                before_homing(t, client, engine, rig)
                run = flies(t, client, engine, rig, documents)
                moves(t, client, engine, WeftRig(client, last_samples=True), documents, run)
                limits(t, client, engine, rig)
                pauses_a_move(t, client, engine, rig)
                pauses_a_flight(t, client, engine, rig, documents)
                for how in "plan", "paused", "bare", "bare, rig":
                    aborts(t, client, engine, rig, documents, how)
                for how in "answer", "bare", "check":
                    aborts_in_kickoff(t, client, engine, rig, documents, how)
                for method in "run.start", "recipe.check":
                    pauses_in_kickoff(t, client, engine, rig, documents, method)
                loses_start(t, client, engine, rig, documents)
                for executed in True, False:
                    loses_start_in_abort(t, client, engine, rig, documents, executed)
                    loses_abort(t, client, engine, rig, documents, executed)
                loses_stop(t, client, engine, rig, documents)
                loses_jog(t, client, engine, rig)
                lifts_at_once(t, client, engine, rig)
                for how in "abort", "halt", "fail", "lost":
                    ends_a_move(t, client, engine, rig, how)
            t.expect(daemon.end() == 0, "end of the daemon")
        finally:
            daemon.process.kill()
    print(f"{t.count} checks, {len(t.failures)} failed")
    return 1 if t.failures else 0


if __name__ == "__main__":
    sys.exit(main())

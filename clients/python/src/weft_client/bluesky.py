"""A rig as devices of Bluesky (extra: bluesky; Python 3.11 or newer).

    from bluesky import RunEngine
    from bluesky.plans import scan
    from weft_client.bluesky import WeftCampaign, WeftRig, fly_recipe
    engine, rig = RunEngine(), WeftRig(client)
    engine(fly_recipe(WeftCampaign(rig, "first")))      # a run homes the stages, and ends with the probe lifted
    engine(scan([rig.z], rig.x, 70, 80, 3))

Positions in mm, for rx and ry in degrees; z counts downwards. Nothing moves before stage(), which acquires the lease of the rig. unstage() lifts the probe
and releases the lease. The RunEngine calls it at every end of a plan, also after an abort. All methods run on the RunEngine's loop.
"""
from __future__ import annotations

import asyncio
import contextlib
import math
import time
import uuid
from concurrent.futures import Future
from typing import Any, AsyncIterator, Dict, Iterator, List, Mapping, Optional

try:
    import bluesky.plan_stubs as bps
    import bluesky.preprocessors as bpp
    from ophyd_async.core import AsyncStatus, Device, WatchableAsyncStatus, WatcherUpdate
except ImportError as missing:
    raise ImportError("weft_client.bluesky needs bluesky and ophyd-async (Python 3.11 or newer): pip install 'weft-client[bluesky]'") from missing

from ._client import Client
from ._errors import AccessError, ConnectionLost, DeviceError, RequestError, StateError, WeftError
from ._lease import Lease
from ._run import End, Run, end_of

JsonObject = Dict[str, Any]

_WRAPPERS: Any = bpp  # its functions have no annotations
_AXES = ("x", "y", "z", "rx", "ry")
_ARRIVED = 0.02  # largest distance from the target [mm, deg]
_LOCATING_M = -1e-5  # upwards
_SAMPLE_S, _SAMPLES = 0.05, 200  # time between two looks for the first sample of a run [s], and their number
_REPEAT_S = 0.1  # pause before a request is repeated after a lost connection [s]
_NO_LEASE = "none"  # run.start with it finds the run of an earlier request with the same idem, and starts nothing
_FORCES, _TORQUES = ("fx_n", "fy_n", "fz_n"), ("tx_nm", "ty_nm", "tz_nm")
_ENDED = ("ended", "interrupted")


def _unit_of(axis: str) -> str:
    return "deg" if axis.startswith("r") else "mm"


def _si(axis: str, value: float) -> float:
    return math.radians(value) if axis.startswith("r") else value / 1000


def _from_si(axis: str, value: float) -> float:
    return math.degrees(value) if axis.startswith("r") else value * 1000


def _key(source: str, dtype: str, shape: Optional[List[int]] = None, units: str = "", **more: object) -> JsonObject:
    return {"source": source, "dtype": dtype, "shape": shape or [], **({"units": units} if units else {}), **more}


class _Bench:
    """Shared by the devices of one rig: client, lease, last known positions, the motion in progress."""

    def __init__(self, client: Client, last_samples: bool) -> None:
        self.client, self.last_samples = client, last_samples
        self.description, info = client.api.rig.describe(), client.api.system.info()
        self.metadata: JsonObject = {"rig": self.description["rig"], "bench": self.description["bench"],
                                  "simulated": bool(self.description["simulated"]), "version": info["version"]}
        self.source = f"weft://{self.metadata['rig']}"
        self.moving = asyncio.Lock()  # one motion at a time, as in the daemon
        self.flights: "set[asyncio.Event]" = set()  # campaigns in progress
        self.last_positions: Optional[Dict[str, float]] = None  # positions [mm, deg]; None: not known
        self.moved, self.safe = False, False  # since the lease: anything was moved; the last motion was answered and left the rig safe
        self._lease: Optional[Lease] = None
        self._holders, self._leasing = 0, asyncio.Lock()

    async def call(self, method: str, **params: object) -> JsonObject:
        """Sends a request and waits for its answer without a limit. Errors: WeftError."""
        pending = await asyncio.to_thread(self.client.request, method, params)
        answer: JsonObject = await asyncio.wrap_future(pending)
        return answer

    async def insist(self, method: str, *, sent: "Optional[Future[Any]]" = None, **params: object) -> JsonObject:
        """Like call(), but repeats the request after a lost connection. For requests that read, or have an `idem`. `sent`: the first one, sent already.
        Errors: WeftError; ConnectionLost only as in again()."""
        while True:
            try:
                if sent is None:
                    return await self.call(method, **params)
                answer: JsonObject = await asyncio.wrap_future(sent)
                return answer
            except ConnectionLost as lost:
                await self.again(lost)
                sent = None

    async def again(self, lost: ConnectionLost) -> None:
        """Waits before a request is repeated. Raises `lost` if the client is closed or never reconnects (connect(tries=0))."""
        if self.client.closed or not self.client.reconnects:
            raise lost
        await asyncio.sleep(_REPEAT_S)

    @property
    def lease(self) -> str:
        """Errors: StateError before stage(), or the reason why the lease was lost."""
        if self._lease is None:
            raise StateError("rig not staged", 3000, {"kind": "state.conflict", "where": str(self.metadata["rig"]), "expected": "staged",
                                                      "hint": "Use bluesky.preprocessors.stage_decorator, or a plan that stages its devices"})
        if self._lease.lost is not None:
            raise self._lease.lost
        return self._lease.name

    async def acquire_lease(self) -> None:
        async with self._leasing:
            if self._lease is None:
                self._lease = await asyncio.to_thread(self.client.lease, "bluesky")
            self._holders += 1

    async def release_lease(self) -> None:
        async with self._leasing:
            self._holders -= 1
            if self._holders == 0 and self._lease is not None:
                ended, self._lease, self.last_positions, self.moved, self.safe = self._lease, None, None, False, False
                await asyncio.to_thread(ended.close)

    def positions(self) -> Dict[str, float]:
        """Errors: StateError if they are not known: before stage(), and after a campaign until the next motion."""
        if self.last_positions is None:
            raise StateError("position not known", 3000, {"kind": "state.conflict", "where": str(self.metadata["rig"]), "hint": "Stage or move the rig"})
        return self.last_positions

    async def locate(self) -> Dict[str, float]:
        """Reads the positions by a motion of 0.01 mm upwards, if they are not known: the API reports them only with a motion."""
        if self.last_positions is None:
            await self._still()
            await self.jog("z", _LOCATING_M)
        return self.positions()

    async def jog(self, axis: str, distance: float) -> None:
        """One motion; `distance` in m or rad. Errors: WeftError; DeviceError if the motion did not complete."""
        async with self.moving:
            await self._motion("rig.jog", axis=axis, distance=distance)

    def send_lift(self) -> "Optional[Future[Any]]":
        """Sends rig.retract at once, unless nothing has moved, the rig is safe or in motion, or the connection is lost. lift() takes the answer."""
        if not self.moved or self.safe or self.moving.locked() or self.flights:
            return None
        with contextlib.suppress(WeftError):  # lift() tries again, and has the error
            return self.client.request("rig.retract", {"lease": self.lease})
        return None

    async def lift(self, sent: "Optional[Future[Any]]" = None) -> None:
        """Lifts the probe unless the rig is safe, also over lost connections. Errors: as jog()."""
        async with self.moving:
            if sent is not None:
                with contextlib.suppress(WeftError):  # the state of the rig decides
                    self._arrived(await asyncio.wrap_future(sent))
            while (await self._still())["rig"] != "safe":
                try:
                    return await self._motion("rig.retract")
                except ConnectionLost as lost:
                    await self.again(lost)

    async def _still(self) -> JsonObject:
        """Waits for the end of a motion, if the answer to its order was lost. Returns the state of the rig."""
        while True:
            state = await self.insist("rig.state")
            if "maintenance" not in state:
                return state
            await asyncio.sleep(_SAMPLE_S)

    async def _motion(self, method: str, **params: object) -> None:
        lease = self.lease
        try:
            answer = await self.call(method, lease=lease, **params)
        except (AccessError, RequestError, StateError):
            raise  # refused before motion
        except BaseException:
            self.last_positions, self.moved, self.safe = None, True, False  # it may have moved
            raise
        self.moved = True
        self._arrived(answer)

    def _arrived(self, answer: JsonObject) -> None:
        self.last_positions = {name.partition("_")[0]: _from_si(name, value) for name, value in answer["to"].items()}
        self.safe = answer.get("rig") == "safe"
        if answer["outcome"] != "complete":
            raise DeviceError(f"{answer['order']} not complete", 4000, {"kind": "motion.incomplete", "where": str(self.metadata["rig"]),
                                                                        "got": answer["outcome"], "expected": "complete", "hint": str(answer.get("error", ""))})

    async def sample(self, needed: str) -> JsonObject:
        """Newest values by column, with counts, run, bench_s and live. Errors: StateError without a run in progress (and without `last_samples`)."""
        for _ in range(_SAMPLES):
            state, newest = await self.call("rig.state"), await self.call("run.samples", most=1)
            live = newest["run"] is not None and state.get("run") == newest["run"]
            if not live and not self.last_samples:
                break
            values = dict(zip(newest["columns"], newest["rows"][-1])) if newest["rows"] else {}
            values.update(counts=newest["counts"], run=newest["run"], live=live)
            if values.get(needed) is not None:
                return values
            if not live:
                break
            await asyncio.sleep(_SAMPLE_S)
        raise StateError("no sample", 3000, {"kind": "state.conflict", "where": str(self.metadata["rig"]), "expected": "a run in progress",
                                             "hint": "Read sensors while a campaign flies, or the newest run's last sample: last_samples=True"})


class _Part(Device):  # type: ignore[misc,unused-ignore]
    """A device; its configuration has the rig, its kind of bench and the simulated mark."""

    def __init__(self, bench: _Bench, name: str = "") -> None:
        self._bench = bench
        super().__init__(name=name)

    def metadata(self) -> JsonObject:
        """For a start document: {"weft": {rig, bench, simulated, version}}."""
        return {"weft": dict(self._bench.metadata)}

    def _configuration(self) -> JsonObject:
        return dict(self._bench.metadata)

    async def read_configuration(self) -> JsonObject:
        return {f"{self.name}-{key}": {"value": value, "timestamp": time.time()} for key, value in self._configuration().items()}

    async def describe_configuration(self) -> JsonObject:
        kinds = {bool: "boolean", int: "integer", float: "number", str: "string"}
        return {f"{self.name}-{key}": _key(f"{self._bench.source}/rig.describe", kinds[type(value)]) for key, value in self._configuration().items()}


class _Move:
    stopped: Optional[bool] = None  # the `success` of stop()


class WeftStage(_Part):
    """One axis: movable, readable [mm, deg]. Moves by jogs of at most `step`, so that stop() takes effect after one of them; each jog runs at a tenth of the
    axis' speed and stops when the force changes by 1 N, except z upwards."""

    def __init__(self, bench: _Bench, axis: str, step: float) -> None:
        self.axis, self.step = axis, step
        self.limits = tuple(_from_si(axis, end) for end in bench.description["travel"][f"{axis}_{'rad' if axis.startswith('r') else 'm'}"])
        self._move, self._target = _Move(), math.nan
        super().__init__(bench)

    @property
    def hints(self) -> JsonObject:
        return {"fields": [self.name]}

    def _configuration(self) -> JsonObject:
        return {**self._bench.metadata, "low": self.limits[0], "high": self.limits[1]}

    def _require_within(self, value: float) -> None:
        low, high = self.limits
        if not low <= value <= high:
            unit = _unit_of(self.axis)
            raise RequestError("target beyond a limit of the rig", 1000, {"kind": "param.range", "where": self.name, "got": f"{value} {unit}",
                                                                          "expected": f"{low:g} to {high:g} {unit}", "hint": "Nothing has moved"})

    async def check_value(self, value: float) -> None:
        """Errors: RequestError beyond a limit."""
        self._require_within(value)

    def set(self, value: float) -> Any:
        """Moves to `value`. Errors: RequestError beyond a limit, before any motion; through the status WeftError."""
        self._require_within(value)
        self._move, self._target = _Move(), value
        return WatchableAsyncStatus(self._moved(value, self._move), name=self.name)

    async def _moved(self, value: float, move: _Move) -> AsyncIterator[Any]:
        start = (await self._bench.locate())[self.axis]
        at = start
        while abs(value - at) > _ARRIVED and move.stopped is None and move is self._move:
            before = at
            await self._bench.jog(self.axis, _si(self.axis, max(-self.step, min(self.step, value - at))))
            at = self._bench.positions()[self.axis]
            if abs(at - before) < _ARRIVED / 10:
                raise DeviceError("stage does not move", 4000, {"kind": "motion.incomplete", "where": self.name, "got": at, "expected": value})
            yield WatcherUpdate(current=at, initial=start, target=value, name=self.name, unit=_unit_of(self.axis))
        if move.stopped is False:
            raise StateError("move stopped", 3000, {"kind": "state.conflict", "where": self.name, "got": at, "expected": value})

    async def stop(self, success: bool = True) -> None:
        """Ends the move after its present jog, and waits for that. Client.halt() stops at once and latches the rig."""
        self._move.stopped = success
        async with self._bench.moving:
            pass

    async def locate(self) -> JsonObject:
        at = self._bench.positions()[self.axis]
        return {"setpoint": at if math.isnan(self._target) else self._target, "readback": at}

    async def read(self) -> JsonObject:
        return {self.name: {"value": self._bench.positions()[self.axis], "timestamp": time.time()}}

    async def describe(self) -> JsonObject:
        low, high = self.limits
        return {self.name: _key(f"{self._bench.source}/rig.jog", "number", units=_unit_of(self.axis), limits={"control": {"low": low, "high": high}})}


class _Sensor(_Part):
    """Each reading has the run and the time [s, clock of the bench] of its sample, and "live": true during that run."""

    def _origin(self, sample: JsonObject) -> JsonObject:
        return {f"{self.name}-run": sample["run"], f"{self.name}-bench_s": sample["bench_s"], f"{self.name}-live": sample["live"],
                f"{self.name}-simulated": self._bench.metadata["simulated"]}

    def _keys(self) -> JsonObject:
        source = f"{self._bench.source}/run.samples"
        return {f"{self.name}-run": _key(source, "string"), f"{self.name}-bench_s": _key(source, "number", units="s"),
                f"{self.name}-live": _key(source, "boolean"), f"{self.name}-simulated": _key(source, "boolean")}


class WeftWrench(_Sensor):
    """Forces [N] and torques [N m] of the newest sample, sensor frame."""

    @property
    def hints(self) -> JsonObject:
        return {"fields": [f"{self.name}-fz_n"]}

    async def read(self) -> JsonObject:
        """Errors: StateError without a sample."""
        sample = await self._bench.sample("fz_n")
        values = {**{f"{self.name}-{column}": sample[column] for column in _FORCES + _TORQUES}, **self._origin(sample)}
        return {key: {"value": value, "timestamp": time.time()} for key, value in values.items()}

    async def describe(self) -> JsonObject:
        source = f"{self._bench.source}/run.samples"
        return {**{f"{self.name}-{column}": _key(source, "number", units="N" if column in _FORCES else "N m") for column in _FORCES + _TORQUES},
                **self._keys()}


class WeftTaxels(_Sensor):
    """Counts of the newest frame, [taxels]."""

    @property
    def hints(self) -> JsonObject:
        return {"fields": []}

    async def read(self) -> JsonObject:
        """Errors: StateError without a frame."""
        sample = await self._bench.sample("counts")
        return {key: {"value": value, "timestamp": time.time()} for key, value in {self.name: sample["counts"], **self._origin(sample)}.items()}

    async def describe(self) -> JsonObject:
        return {self.name: _key(f"{self._bench.source}/run.samples", "array", [int(self._bench.description["taxels"])], "counts"), **self._keys()}


class WeftRig(_Part):
    """A rig: its stages `x`, `y`, `z`, `rx`, `ry`, and `wrench` and `taxels`, each if the rig has it. `await connect()` is not needed.

    step_mm, step_deg  largest part of a move: stop() waits for the end of one
    last_samples       sensors may be read without a run in progress: the last sample of the newest run, with "live" false. The daemon has no newer one
    Errors: WeftError.
    """

    x: WeftStage
    y: WeftStage
    z: WeftStage
    rx: WeftStage
    ry: WeftStage
    wrench: WeftWrench
    taxels: WeftTaxels

    def __init__(self, client: Client, name: str = "rig", *, step_mm: float = 1.0, step_deg: float = 0.5, last_samples: bool = False) -> None:
        bench = _Bench(client, last_samples)
        axes = {key.partition("_")[0] for key in bench.description["travel"]}
        self._parts: List[Any] = []
        self._staged = False
        self._landing: Any = None  # status of the last unstage()
        for axis in _AXES:
            if axis in axes:
                self._parts.append(WeftStage(bench, axis, step_deg if axis.startswith("r") else step_mm))
                setattr(self, axis, self._parts[-1])
        if bench.description["wrench"]:
            self.wrench = WeftWrench(bench)
            self._parts.append(self.wrench)
        if bench.description["taxels"]:
            self.taxels = WeftTaxels(bench)
            self._parts.append(self.taxels)
        super().__init__(bench, name=name)

    @property
    def hints(self) -> JsonObject:
        return {"fields": [field for part in self._parts for field in part.hints["fields"]]}

    async def read(self) -> JsonObject:
        read: JsonObject = {}
        for part in self._parts:
            read.update(await part.read())
        return read

    async def describe(self) -> JsonObject:
        described: JsonObject = {}
        for part in self._parts:
            described.update(await part.describe())
        return described

    @AsyncStatus.wrap  # type: ignore[misc,untyped-decorator,unused-ignore]
    async def stage(self) -> None:
        """Acquires the lease, reads the positions by a motion of 0.01 mm upwards, and lifts the probe unless the rig is safe. Errors: AccessError (lease of
        another user), StateError (stages not homed: a run homes them; latched; a run in progress)."""
        if self._landing is not None:
            await asyncio.wait([self._landing.task])
        if self._staged:
            return
        await self._bench.acquire_lease()
        self._staged = True
        await self._bench.locate()
        await self._bench.lift()

    def unstage(self) -> Any:
        """Lifts the probe unless the rig is safe, and releases the lease. rig.retract is sent before this returns, unless a jog or a campaign is in progress:
        the RunEngine does not always wait for the status. Campaigns in progress are waited for without a limit; unstage them too."""
        if self._staged:
            self._staged = False
            self._landing = AsyncStatus(self._unstage(self._bench.send_lift()), name=self.name)
        return self._landing or AsyncStatus(asyncio.sleep(0), name=self.name)

    async def _unstage(self, sent: "Optional[Future[Any]]") -> None:
        try:
            for over in list(self._bench.flights):
                await over.wait()
            if self._bench.moved:
                await self._bench.lift(sent)
        finally:
            await self._bench.release_lease()


class WeftCampaign(_Part):
    """A campaign of a recipe as a flyer: kickoff() starts a run, complete() waits for its end and its handover, collect() gives an event for each attempt
    (stream NAME-trials) and one for the run (stream NAME), with run, dataset_sha256 and "simulated". Use it with fly_recipe(), or staged: kickoff() refuses
    otherwise, because the RunEngine stops flyers only through unstage().

    run  the newest run, None before kickoff()
    end  its three facts, None until it is over
    """

    def __init__(self, rig: WeftRig, recipe: str, name: str = "campaign", *, seed: Optional[int] = None,
                 parameters: Optional[Mapping[str, object]] = None) -> None:
        self.recipe, self._seed, self._parameters = recipe, seed, dict(parameters) if parameters else None
        self.run: Optional[Run] = None
        self.end: Optional[End] = None
        self._digest = ""
        self._staged = self._collected = self._paused = self._stopping = self._start_requested = False  # _start_requested: run.start is sent
        self._flight_ended: Optional[asyncio.Event] = None
        self._starting: "Optional[asyncio.Task[None]]" = None  # kickoff()
        self._landing: Any = None  # status of the last unstage()
        self._clear = asyncio.Event()  # not set during a pause
        super().__init__(rig._bench, name=name)

    def _configuration(self) -> JsonObject:
        return {**self._bench.metadata, "recipe": self.recipe}

    @AsyncStatus.wrap  # type: ignore[misc,untyped-decorator,unused-ignore]
    async def stage(self) -> None:
        """Acquires the lease. Errors: AccessError."""
        if self._landing is not None:
            await asyncio.wait([self._landing.task])
        if self._staged:
            return
        await self._bench.acquire_lease()
        self.run = self.end = self._starting = None
        self._staged = True
        self._collected = self._paused = self._stopping = self._start_requested = False
        self._clear.set()

    @AsyncStatus.wrap  # type: ignore[misc,untyped-decorator,unused-ignore]
    async def kickoff(self) -> None:
        """Checks the recipe and queues its run. Once for each stage(): a replay after a pause starts nothing, and during a pause nothing starts. Errors:
        RequestError (recipe), StateError (also if stopped before the start)."""
        self._bench.lease
        if not self._staged:
            raise StateError("campaign not staged", 3000, {"kind": "state.conflict", "where": self.name, "hint": "Use fly_recipe(), or stage the campaign"})
        if self.run is not None:
            return
        if self._starting is None or self._starting.done():
            self._starting = asyncio.create_task(self._start())
        try:
            await asyncio.shield(self._starting)  # continues if this is cancelled: unstage() needs the result
        except StateError:
            if self._staged:  # else unstaged meanwhile; a failure would interrupt the clean-up of the plan
                raise

    async def _start(self) -> None:
        check = await self._bench.call("recipe.check", recipe=self.recipe, seed=self._seed, parameters=self._parameters)
        if not check["ok"]:
            first = (check.get("problems") or [{}])[0]
            raise RequestError(f"recipe refused: {first.get('message', 'no reason given')}", 1000, {**first, "kind": "recipe.invalid"})
        self._flight_ended = asyncio.Event()
        self._digest, started = str(check["digest"]), None
        try:
            while started is None:
                await self._clear.wait()
                if self._stopping:
                    raise StateError("campaign stopped before its start", 3000, {"kind": "state.conflict", "where": self.name})
                self._start_requested = True
                self._bench.flights.add(self._flight_ended)
                started = await self._request_start()
                self._start_requested = started is not None
        except WeftError:
            self._start_requested = False
            self._end_flight()
            raise
        self._bench.last_positions = None
        self.run = Run(self._bench.client, str(started["run"]))

    async def _request_start(self) -> Optional[JsonObject]:
        """Answer of run.start, repeated after a lost connection. During a pause, and after stop() or unstage(), a repetition only finds what an earlier request
        has started; None if nothing."""
        params: JsonObject = {"recipe": self.recipe, "seed": self._seed, "parameters": self._parameters, "digest": self._digest, "idem": uuid.uuid4().hex}
        lease = self._bench.lease
        while True:
            try:
                return await self._bench.call("run.start", lease=lease, **params)
            except ConnectionLost as lost:
                await self._bench.again(lost)
            except AccessError:
                if lease == _NO_LEASE:
                    return None
                raise
            if self._stopping or not self._clear.is_set():
                lease = _NO_LEASE

    def _end_flight(self) -> None:
        if self._flight_ended is not None:
            self._flight_ended.set()
            self._bench.flights.discard(self._flight_ended)

    async def _ended(self, hand_over: bool) -> End:
        assert self.run is not None
        return end_of(await self._bench.insist("run.wait", run=self.run.name, hand_over=hand_over or None))

    @AsyncStatus.wrap  # type: ignore[misc,untyped-decorator,unused-ignore]
    async def complete(self) -> None:
        """Waits for the end. Errors: StateError if the run is not complete, unless stop() ended it."""
        if self.run is None:
            raise StateError("campaign not started", 3000, {"kind": "state.conflict", "where": self.name, "hint": "Call kickoff() first"})
        self.end = await self._ended(hand_over=True)
        self._end_flight()
        if self.end.outcome != "complete" and not self._stopping:
            raise StateError("run not complete", 3000, {"kind": "run.incomplete", "where": self.run.name, "got": self.end.outcome, "expected": "complete",
                                                        "hint": self.end.error})

    async def pause(self) -> None:
        """Pauses the run at once: the probe is retracted, and the interrupted trial is repeated after resume()."""
        self._clear.clear()
        if self._start_requested and self._starting is not None:
            await asyncio.wait([self._starting])
        if self.run is None or (await self._state()) in _ENDED:
            return
        try:
            await self._bench.insist("run.pause", run=self.run.name, at="now", idem=uuid.uuid4().hex)
        except StateError:
            if (await self._state()) in _ENDED:
                return
            raise
        self._paused = True
        while (await self._state()) in ("queued", "running", "pausing", "arming", "resuming"):
            await asyncio.sleep(_SAMPLE_S)

    async def resume(self) -> None:
        if self.run is not None and self._paused and (await self._state()) == "held":
            await self._bench.insist("run.resume", run=self.run.name, idem=uuid.uuid4().hex)
        self._paused = False
        self._clear.set()

    async def _state(self) -> str:
        assert self.run is not None
        return str((await self._bench.insist("run.get", run=self.run.name))["state"])

    def _no_start(self) -> None:
        """From now on kickoff() sends no run.start that could start anything."""
        self._stopping = True
        self._clear.set()

    async def stop(self, success: bool = True) -> None:
        """Ends the run after the present trial; with `success` false at once, as unstage(). Waits for a kickoff() in progress."""
        self._no_start()
        if self._starting is not None:
            await asyncio.wait([self._starting])
        if self.run is not None and self.end is None:
            try:
                await self._bench.insist("run.stop" if success else "run.abort", run=self.run.name, idem=uuid.uuid4().hex)
            except StateError:
                if (await self._state()) not in _ENDED:
                    raise

    def unstage(self) -> Any:
        """Aborts a run that is not over, waits until the probe is lifted, and releases the lease. The order is sent before this returns, or after the answer to
        a run.start in progress: the RunEngine does not always wait for the status. After a lost connection it is repeated. Errors, through the status:
        StateError if the rig is not safe afterwards."""
        if self._staged:
            self._staged = False
            self._no_start()
            sent: "Optional[Future[Any]]" = None
            idem = uuid.uuid4().hex
            if self.run is not None and self.end is None:
                with contextlib.suppress(WeftError):  # _abort() sends it again, and has the error
                    sent = self._bench.client.request("run.abort", {"run": self.run.name, "idem": idem})
            self._landing = AsyncStatus(self._unstage(sent, idem), name=self.name)
        return self._landing or AsyncStatus(asyncio.sleep(0), name=self.name)

    async def _unstage(self, sent: "Optional[Future[Any]]", idem: str) -> None:
        try:
            if self._starting is not None:
                await asyncio.wait([self._starting])
            if sent is not None or (self.run is not None and self.end is None):
                await self._abort(sent, idem)
        finally:
            self._end_flight()
            await self._bench.release_lease()

    async def _abort(self, sent: "Optional[Future[Any]]", idem: str) -> None:
        assert self.run is not None
        try:
            await self._bench.insist("run.abort", sent=sent, run=self.run.name, idem=idem)
        except ConnectionLost:
            raise
        except WeftError:
            if (await self._state()) not in _ENDED:
                raise
        self.end = await self._ended(hand_over=False)
        state = await self._bench.insist("rig.state")
        if state["rig"] != "safe":
            raise StateError("rig not safe after the abort", 3000, {"kind": "state.conflict", "where": self.run.name, "got": state["rig"], "expected": "safe",
                                                                    "hint": "Inspect the rig, then reset it with a reason"})

    # --- documents ---

    async def describe_collect(self) -> JsonObject:
        trial, run = f"{self._bench.source}/data.trials", f"{self._bench.source}/run.get"
        shared = {"run": "string", "dataset_sha256": "string", "simulated": "boolean"}
        trials = {"trial": "string", "label": "string", "exploration": "string", "outcome": "string", "sha256": "string", "index": "integer",
                  "attempt": "integer", "repetition": "integer", "lost_frames": "integer", "force_rms_error_n": "number", "force_in_band_share": "number"}
        columns = {"recipe": "string", "recipe_digest": "string", "outcome": "string", "cleanup": "string", "rig": "string", "trials_done": "integer",
                 "trials_planned": "integer", "accuracy": "number"}
        units = {"force_rms_error_n": "N"}
        return {f"{self.name}-trials": {f"{self.name}-trials-{key}": _key(trial, kind, units=units.get(key, "")) for key, kind in {**trials, **shared}.items()},
                self.name: {f"{self.name}-{key}": _key(run, kind) for key, kind in {**columns, **shared}.items()}}

    async def collect(self) -> AsyncIterator[JsonObject]:
        """Once, after the end of the run; before it nothing. `accuracy` is the lowest of the explorations, NaN if it was not evaluated."""
        if self.run is None or self._collected:
            return
        state = await self._bench.insist("run.get", run=self.run.name)
        if state["state"] not in _ENDED:
            return
        shared = {"run": self.run.name, "dataset_sha256": state.get("dataset_sha256") or "", "simulated": self._bench.metadata["simulated"]}
        trials = [trial async for trial in self._trials()]
        self._collected = True  # only now: a failed reading may be repeated
        for trial in trials:
            yield self._event(f"{self.name}-trials", {**trial, **shared})
        accuracies = [result["accuracy"] for result in state.get("result") or [] if result.get("accuracy") is not None]
        yield self._event(self.name, {
            "recipe": self.recipe, "recipe_digest": self._digest, "outcome": state.get("outcome") or "", "cleanup": state.get("cleanup") or "",
            "rig": state.get("rig") or "", "trials_done": state["trials_done"], "trials_planned": state["trials_planned"],
            "accuracy": min(accuracies) if accuracies else math.nan, **shared})

    async def _pages(self, method: str, most: int) -> AsyncIterator[JsonObject]:
        """Nothing if the first page is refused: the run has none. Errors: WeftError of a later page."""
        assert self.run is not None
        first: Optional[int] = 0
        while first is not None:
            try:
                params: JsonObject = {"run": self.run.name, "most": most, "from": first}
                page = await self._bench.insist(method, **params)
            except (RequestError, StateError):
                if first == 0:
                    return
                raise
            for item in page["trials"]:
                yield item
            first = page.get("next")

    async def _trials(self) -> AsyncIterator[JsonObject]:
        """The attempts; none if the run recorded nothing. A run without certificate has no digests."""
        digests: "Dict[str, List[str]]" = {}
        async for item in self._pages("data.certificate", 1000):
            digests.setdefault(str(item["name"]), []).append(str(item.get("sha256") or ""))
        async for item in self._pages("data.trials", 200):
            rms, share = item.get("force_rms_error_N"), item.get("force_in_band_share")
            yield {**{key: item[key] for key in ("trial", "label", "exploration", "outcome", "index", "attempt", "repetition", "lost_frames")},
                   "sha256": (digests.get(item["trial"]) or [""]).pop(0), "force_rms_error_n": math.nan if rms is None else rms,
                   "force_in_band_share": math.nan if share is None else share}

    def _event(self, prefix: str, values: JsonObject) -> JsonObject:
        now = time.time()
        return {"time": now, "data": {f"{prefix}-{key}": value for key, value in values.items()},
                "timestamps": {f"{prefix}-{key}": now for key in values}}


def fly_recipe(campaign: WeftCampaign, md: Optional[Mapping[str, object]] = None) -> Iterator[Any]:
    """Plan: flies the campaign in one Bluesky run. A pause of the RunEngine pauses the run. Any early end aborts it; the documents then have what was
    recorded."""

    def flight() -> Iterator[Any]:
        yield from bps.stage(campaign, wait=True)
        yield from bps.checkpoint()
        yield from bps.kickoff(campaign, wait=True)
        yield from bps.checkpoint()
        yield from bps.complete(campaign, wait=True)

    def landing() -> Iterator[Any]:
        yield from bps.unstage(campaign, wait=True)
        yield from bps.collect(campaign)

    def whole() -> Iterator[Any]:
        yield from _WRAPPERS.finalize_wrapper(flight(), landing())

    yield from _WRAPPERS.run_wrapper(whole(), md={**campaign.metadata(), "recipe": campaign.recipe, **(md or {})})

"""One run of the daemon: its state, end, commands and files."""
from __future__ import annotations

import os
import pathlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Optional, Union

from ._errors import RequestError
from ._files import DataFile, fetch
from ._watch import Event, JsonObject, Watch

if TYPE_CHECKING:
    from ._client import Client
    from ._lease import Lease

_OVER = ("ended", "interrupted")


@dataclass(frozen=True)
class Check:
    """Result of `recipe.check`. `plan` has eta_s [s], people_s [s], bytes, trials, fabrics."""

    ok: bool
    plan: Dict[str, Any]
    problems: List[Any]
    warnings: List[Any]
    disk_ok: bool
    digest: str


@dataclass(frozen=True)
class End:
    """How a run ended, as three facts: `outcome` (complete, stopped, aborted, failed, interrupted), `cleanup` (done, partial, failed, skipped) and
    `rig` (safe, holding, moving, unknown, latched). `error` is a sentence about the first failure, "" if there was none. `dataset_error` is the
    reason why the recorded trials have no data set, or ""."""

    outcome: str
    cleanup: str
    rig: str
    dataset_sha256: str
    error: str
    dataset_error: str
    state: Dict[str, Any] = field(repr=False)


def end_of(state: JsonObject) -> End:
    return End(str(state.get("outcome", "")), str(state.get("cleanup", "")), str(state.get("rig", "")), str(state.get("dataset_sha256", "")),
               str(state.get("error", "")), str(state.get("dataset_error", "")), state)


class Run:
    """A run by its name, "R-000318". Only methods send requests."""

    def __init__(self, client: "Client", name: str) -> None:
        self._client, self.name = client, name

    def __repr__(self) -> str:
        return f"Run({self.name!r})"

    def state(self) -> JsonObject:
        return self._client.api.run.get(run=self.name)

    def wait(self, timeout_s: Optional[float] = None, hand_over: bool = False) -> End:
        """Waits for the end of the run, and with `hand_over` also for its handover. Errors: TimeoutError."""
        params: JsonObject = {"run": self.name, **({"hand_over": True} if hand_over else {})}
        return end_of(self._client.answer(self._client.request("run.wait", params), timeout_s))

    def watch(self, mode: str = "latest", max_hz: float = 20) -> Watch:
        """Watches the events of the run from now on, until its end."""
        topic = f"run:{self.name}"
        watch = self._client.watch(topic, mode=mode, max_hz=max_hz)
        now = self.state()
        # A run of an earlier start of the daemon has no events in this one.
        over = Event(topic, now, now, 0, snapshot=True) if now.get("state") in _OVER else None
        return watch.ending_with(lambda event: event.state.get("state") in _OVER, over)

    def pause(self, now: bool = False) -> JsonObject:
        """Pauses before the next repetition. With `now`: at once, and that repetition is repeated."""
        return self._client.api.run.pause(run=self.name, at="now" if now else "boundary")

    def resume(self, lease: "Union[None, str, Lease]" = None) -> JsonObject:
        """Resumes the run. An interrupted run needs a lease."""
        return self._client.api.run.resume(run=self.name, lease=_name(lease))

    def stop(self) -> JsonObject:
        """Finishes the repetition, then cleans up and ends the run."""
        return self._client.api.run.stop(run=self.name)

    def abort(self) -> JsonObject:
        """Stops motion, retracts and ends the run."""
        return self._client.api.run.abort(run=self.name)

    def confirm(self, step: Optional[str] = None) -> JsonObject:
        """Confirms an operator step. `step` names it; None: the one that is pending. Errors: RequestError if none is pending."""
        if step is None:
            asked = self.state().get("attention") or {}
            if not asked.get("step"):
                raise RequestError("no operator step pending", 1000, {"kind": "request.invalid", "where": self.name,
                                                                      "hint": "Read the next operator step in state()['attention']"})
            step = str(asked["step"])
        return self._client.api.run.confirm(run=self.name, step=step)

    # --- data ---

    def files(self) -> List[DataFile]:
        """Files to download, with sizes and digests; only after the end of the run."""
        return [DataFile.of(told) for told in self._client.api.data.get(run=self.name)["files"]]

    def file(self, name: str) -> DataFile:
        """One of files(). Errors: RequestError, with the names that exist."""
        files = self.files()
        for found in files:
            if found.name == name:
                return found
        raise RequestError("file not found in the run", 1004, {"kind": "not_found", "where": self.name, "got": name,
                                                               "expected": ", ".join(f.name for f in files)})

    def download(self, name: str, to: "Union[str, os.PathLike[str]]") -> pathlib.Path:
        """Downloads one of files() over HTTP and checks its digest. `to` is an existing folder, a name that ends in "/", or a file. A partial file of
        an earlier attempt is resumed. Needs the client's `http` and a token. Errors: DataAltered, AccessError, ConnectionLost."""
        folder = os.fspath(to).endswith(("/", os.sep))  # pathlib.Path drops the slash
        place = pathlib.Path(to)
        if folder:
            place.mkdir(parents=True, exist_ok=True)
        return fetch(self._client.http, self.file(name), place)

    def folder(self) -> pathlib.Path:
        """Folder of the run on the daemon's machine."""
        return pathlib.Path(self.state()["folder"])

    def verify(self) -> JsonObject:
        """Checks every byte of the files against the certificate."""
        return self._client.api.data.verify(run=self.name)


def _name(lease: "Union[None, str, Lease]") -> Optional[str]:
    return lease if lease is None or isinstance(lease, str) else lease.name


def runs_of(client: "Client", state: Optional[str]) -> Iterator[Run]:
    page = client.api.run.list(state=state)
    while True:
        for told in page["runs"]:
            yield Run(client, str(told["run"]))
        if page.get("next") is None:
            return
        page = client.api.run.list(state=state, from_=page["next"])

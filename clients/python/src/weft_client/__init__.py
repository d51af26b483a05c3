"""Client of weftd. Needs only the standard library.

    import weft_client
    with weft_client.connect("data/weftd.sock") as client, client.lease() as lease:
        run = client.start("m1", lease)
        for event in run.watch():
            print(event.state.get("trials_done"), "of", event.state.get("trials_planned"))
        print(run.wait())

Trials as arrays: weft_client.campaign (numpy), weft_client.dataset (h5py), weft_client.frames (pandas),
weft_client.xarrays (xarray). A data set as Parquet or MCAP: python3 -m weft_client.export.
"""
from ._client import VERSION as __version__
from ._client import Client, connect, halt
from ._errors import (AccessError, ConnectionLost, DataAltered, DeviceError, InternalError, RequestError, SafetyError, StateError, StorageError,
                      WeftError)
from ._files import DataFile
from ._lease import Lease
from ._merge import merge_patch
from ._run import Check, End, Run
from ._trial import Trial
from ._watch import Event, Watch

__all__ = ["AccessError", "Check", "Client", "ConnectionLost", "DataAltered", "DataFile", "DeviceError", "End", "Event", "InternalError", "Lease",
           "RequestError", "Run", "SafetyError", "StateError", "StorageError", "Trial", "Watch", "WeftError", "__version__", "connect", "halt",
           "merge_patch"]

#include "daemon/apps/weft/command_specs.hpp"

#include <algorithm>
#include <array>

#include "protocols/base/result.hpp"

namespace weft::daemon::cli {
namespace {

constexpr std::array<CommandGroupSpec, 5> group_rows{{
    {"Acquire", "run a campaign from this terminal",
     "weft run recipes/library/first.json --rig sim/rigs/bench17.json --out out/a"},
    {"Daemon", "run campaigns in the background (weftd)",
     "weft start first --wait --socket out/lab/weftd.sock"},
    {"Data", "check, convert and show what was recorded", "weft dataset info out/a/dataset.h5"},
    {"Learn", "train and test models",
     "weft fabric evaluate out/a/dataset.h5 --train-fraction 0.4 --learner lda"},
    {"Studies", "compare settings", "weft design repetitions out/a/dataset.h5 --predict 20"},
}};

constexpr std::array<CommandSpec, 85> command_rows{{
    {"Acquire", "check", "check a recipe against a rig; nothing moves",
     "recipes/library/first.json --rig sim/rigs/bench17.json"},
    {"Acquire", "run", "run a campaign: record, evaluate, report",
     "recipes/library/first.json --rig sim/rigs/bench17.json --out out/a"},
    {"Acquire", "doctor", "check devices, ports and machine; list what to fix",
     "--rig sim/rigs/bench17.json"},
    {"Acquire", "init", "find devices and write a rig file; nothing moves", "my-rig.json"},
    {"Acquire", "align", "measure the tilt of the plate by touch and level it",
     "--rig sim/rigs/bench17.json"},
    {"Daemon", "start", "queue a recipe and run it when the rig is free", "first --wait"},
    {"Daemon", "queue", "list, add, remove, move, pause or start queued runs", "list"},
    {"Daemon", "queue list", "list the queued runs in the order in which they start", ""},
    {"Daemon", "queue add", "add a recipe to the daemon's queue", "first --repeat 3"},
    {"Daemon", "queue remove", "remove a run from the queue", "R-000007"},
    {"Daemon", "queue move", "move a queued run to another place", "R-000007 1"},
    {"Daemon", "queue edit", "change seed, name or place of a queued run", "R-000007 --seed 5"},
    {"Daemon", "queue clear", "remove all runs from the queue", ""},
    {"Daemon", "queue history", "list the changes of the queue", ""},
    {"Daemon", "queue pause", "stop starting queued runs", ""},
    {"Daemon", "queue start", "start queued runs again when the rig is free", ""},
    {"Daemon", "status", "show the rig, the current run and the queue", ""},
    {"Daemon", "watch", "follow a run until it ends", "R-000007"},
    {"Daemon", "confirm", "confirm that the requested operator step is done", ""},
    {"Daemon", "pause", "hold a run before its next trial", ""},
    {"Daemon", "resume", "continue a held or interrupted run", ""},
    {"Daemon", "recover", "resume or discard an interrupted run, or keep its trials",
     "R-000007 resume --preview"},
    {"Daemon", "stop", "end a run after the current trial", ""},
    {"Daemon", "abort", "end a run now and lift the probe", ""},
    {"Daemon", "halt", "stop all motion and latch the rig until reset", "the cable is loose"},
    {"Daemon", "estop", "halt; only an engineer can reset", "the probe is bent"},
    {"Daemon", "reset", "clear the latch after inspecting the rig", "\"cable fixed\""},
    {"Daemon", "lock", "lock the rig in your name, so that nothing can move",
     "\"probe is being changed\""},
    {"Daemon", "unlock", "remove the lock of the rig", "\"probe changed\""},
    {"Daemon", "retract", "lift the probe to the clear height, outside a run", ""},
    {"Daemon", "park", "lift the probe, then move to the park position", ""},
    {"Daemon", "jog", "move one axis by a small distance, outside a run", "z 0.5"},
    {"Daemon", "annotate", "set the tags or the note of a run", "R-000007 --tag pilot"},
    {"Daemon", "log", "show the daemon's journal", "R-000007"},
    {"Daemon", "page", "print a link to the web page, valid for one day", ""},
    {"Daemon", "data", "manage the campaigns that the daemon lists", ""},
    {"Daemon", "data import", "add a campaign folder of `weft run` to the daemon's runs", "out/a"},
    {"Daemon", "token", "add, list or remove access tokens", ""},
    {"Daemon", "token add", "create a token and print it once",
     "ada --tokens tokens.json --role operator"},
    {"Daemon", "token list", "list tokens: user, role, expiry", "--tokens tokens.json"},
    {"Daemon", "token remove", "remove a token", "ada --tokens tokens.json"},
    {"Daemon", "call", "call any method of the daemon's API", "rig.state"},
    {"Data", "verify", "compare a campaign or data set with its certificate", "out/a"},
    {"Data", "dataset", "import, export or describe data sets", ""},
    {"Data", "dataset import", "import recordings of other programs as a data set",
     "recordings/manifest.csv -o mine.h5"},
    {"Data", "dataset export", "write the complete trials of a campaign as a data set",
     "out/a/campaign.sqlite -o a.h5"},
    {"Data", "dataset merge", "merge the parts of a campaign into one data set",
     "part-1 part-2 -o merged.h5"},
    {"Data", "dataset info", "describe the contents of a data set", "out/a/dataset.h5"},
    {"Data", "export", "write the complete trials of a campaign to one file",
     "out/a --format hdf5"},
    {"Data", "report", "write an HTML report of a finished campaign", "out/a"},
    {"Learn", "fabric", "learn fabrics from tactile trials (Khan 2016)", ""},
    {"Learn", "vibro", "learn textures from sound and vibration (2023)", ""},
    {"Learn", "imprint", "simulate and learn static imprints (Ellis 1986)", ""},
    {"Learn", "fabric features", "write the features of a data set as CSV",
     "out/a/dataset.h5 -o features.csv"},
    {"Learn", "fabric evaluate", "train and test on splits of a data set",
     "out/a/dataset.h5 --train-fraction 0.4 --learner lda"},
    {"Learn", "fabric train", "train a model on a data set", "out/a/dataset.h5 -o model.weft"},
    {"Learn", "fabric classify", "predict the labels of recordings with a model",
     "model.weft out/a/dataset.h5"},
    {"Learn", "vibro features", "write the features of a data set as CSV",
     "strokes.h5 -o features.csv"},
    {"Learn", "vibro evaluate", "train and test on splits of a data set",
     "strokes.h5 --learner lda --leave-one-group-out"},
    {"Learn", "vibro train", "train a model on a data set", "strokes.h5 -o model.weft"},
    {"Learn", "vibro classify", "predict the labels of recordings with a model",
     "model.weft strokes.h5"},
    {"Learn", "imprint features", "write the features of a data set as CSV",
     "imprints.h5 -o features.csv"},
    {"Learn", "imprint evaluate", "train and test on splits of a data set",
     "imprints.h5 --train-fraction 0.4 --learner lda"},
    {"Learn", "imprint train", "train a model on a data set", "imprints.h5 -o model.weft"},
    {"Learn", "imprint classify", "predict the labels of recordings with a model",
     "model.weft imprints.h5"},
    {"Learn", "imprint scene", "simulate imprints of twelve objects as a data set",
     "-o imprints.h5"},
    {"Learn", "imprint tables", "repeat the paper's four experiments on imprints",
     "imprints.h5 -o tables.html"},
    {"Learn", "imprint search", "find the smoothing scales that separate the classes best",
     "imprints.h5"},
    {"Learn", "audit", "find how much of an accuracy does not come from the material",
     "out/a/dataset.h5"},
    {"Studies", "trade", "plot accuracy against time", ""},
    {"Studies", "trade classifier", "compare learners, features, slide lengths and votes",
     "out/a/dataset.h5 -o trade.html"},
    {"Studies", "trade vibro", "compare learners, features and windows of vibration",
     "strokes.h5 -o trade.html"},
    {"Studies", "trade sim", "compare simulation levels, integrators and step sizes",
     "--quick -o trade.html"},
    {"Studies", "design", "choose force, speed and number of repetitions", ""},
    {"Studies", "design analyse", "compare the cells of a sweep: separability and time",
     "out/sweep/dataset.h5"},
    {"Studies", "design repetitions", "forecast the accuracy of more repetitions",
     "out/a/dataset.h5 --predict 20"},
    {"Studies", "sim", "fit the simulated bench to recordings", ""},
    {"Studies", "sim calibrate", "fit simulated fabrics and pads to recordings",
     "strokes.h5 -o fabrics.json"},
    {"Studies", "sim strokes", "simulate the strokes of recordings as a data set",
     "strokes.h5 -o simulated.h5"},
    {"", "manual", "print the manual page, for `man -l -`", ""},
    {"", "completion", "print the completion script of a shell", "bash"},
    {"Earlier", "features", "write the features of a data set as CSV",
     "out/a/dataset.h5 -o features.csv"},
    {"Earlier", "evaluate", "train and test on splits of a data set",
     "out/a/dataset.h5 --train-fraction 0.4 --learner lda"},
    {"Earlier", "train", "train a model on a data set", "out/a/dataset.h5 -o model.weft"},
    {"Earlier", "classify", "predict the labels of recordings with a model",
     "model.weft out/a/dataset.h5"},
}};

}  // namespace

std::span<const CommandGroupSpec> command_groups() {
  return group_rows;
}

std::span<const CommandSpec> command_specs() {
  return command_rows;
}

const CommandSpec& command_spec(std::string_view path) {
  const auto* const found = std::ranges::find(command_rows, path, &CommandSpec::path);
  WEFT_ASSERT(found != command_rows.end());
  return *found;
}

}  // namespace weft::daemon::cli

#pragma once
// `weft train` and `weft classify` on recordings of sound and vibration.

#include "daemon/apps/weft/console.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

struct TrainArgs;
struct ClassifyArgs;

/// Whether `args` is about recordings: a file of them, or a data set with --method.
bool is_about_recordings(const TrainArgs& args);
Result<int> run_train_recordings(const TrainArgs& args, Console& console);

/// `args.model` is one of recordings.
Result<int> run_classify_recordings(const ClassifyArgs& args, Console& console);

}  // namespace weft::daemon::cli

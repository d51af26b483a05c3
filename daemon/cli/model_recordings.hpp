#pragma once
// `weft train` and `weft classify` on recordings of sound and vibration.

#include <filesystem>

#include "daemon/cli/console.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

struct TrainArgs;
struct ClassifyArgs;

/// Whether `args` is about recordings: a file of them, or a data set with --method.
bool is_about_recordings(const TrainArgs& args);
Result<int> run_train_recordings(const TrainArgs& args, Console& console);

/// Whether the file is a model of recordings; false of one that cannot be read.
bool is_recording_model_file(const std::filesystem::path& path);
Result<int> run_classify_recordings(const ClassifyArgs& args, Console& console);

}  // namespace weft::daemon::cli

#pragma once
// The samples of one stream as a CSV table, for programs that do not read HDF5.

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// "taxels", "wrench", "stages", "acceleration", "sound".
const std::vector<std::string_view>& sample_stream_names();
std::optional<Stream> sample_stream_from(std::string_view name);

struct WrittenSamples {
  std::string bench;           ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;  ///< digest of the complete trials, all streams
  std::size_t trials = 0;
};

/// Writes a heading and one row for each sample of the complete trials of a campaign file, in plan
/// order: bench, trial, label, exploration, repetition, phase, t_s, then the values with their
/// units. Columns: docs/reference/dataset.md, "Samples as a table". One trial is in memory at a
/// time. Errors: load_campaign()'s; not_found without a complete trial or such a stream; io;
/// wrong_state if stopped.
Result<WrittenSamples> write_samples_csv(const std::filesystem::path& campaign, Stream stream,
                                         std::ostream& out, const StopRequested& stop_requested);

}  // namespace weft::daemon

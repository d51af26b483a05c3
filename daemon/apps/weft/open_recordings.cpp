#include "daemon/apps/weft/open_recordings.hpp"

#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace weft::daemon::cli {

Result<RecordingSet> open_all_recordings(const std::filesystem::path& path) {
  if (is_recordings_file(path)) return read_recordings(path);
  const auto dataset = open_dataset(path);
  if (!dataset) return pass(dataset.error());
  auto out = extract_recordings(*dataset);
  if (!out) return pass(out.error(), path.string());
  return out;
}

Result<RecordingSet> open_recordings(const std::filesystem::path& path,
                                     const std::string& exploration, bool one_exploration) {
  if (exploration.find('+') != std::string::npos)
    return fail({.code = Errc::unsupported,
                 .where = "--exploration",
                 .what = "recordings of two explorations have nothing in common",
                 .expected = "one name",
                 .got = exploration});
  if (is_recordings_file(path)) {
    if (exploration.empty()) return read_recordings(path);
    return fail({.code = Errc::invalid_argument,
                 .where = path.string() + ": --exploration",
                 .what = "a file of recordings has no explorations",
                 .expected = "a campaign",
                 .got = exploration});
  }
  const auto dataset = open_dataset(path);
  if (!dataset) return pass(dataset.error());
  const auto chosen = find_exploration(*dataset, exploration, one_exploration);
  if (!chosen) return pass(chosen.error(), path.string());
  auto out = extract_recordings(*dataset, *chosen);
  if (!out) return pass(out.error(), path.string());
  return out;
}

}  // namespace weft::daemon::cli

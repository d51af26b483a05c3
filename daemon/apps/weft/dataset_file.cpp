#include "daemon/apps/weft/dataset_file.hpp"

#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <istream>
#include <set>

#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon::cli {
namespace {

/// A damaged file, or one of which only the log is left, is recognised by its name.
bool is_campaign(const std::filesystem::path& path) {
  std::error_code unseen;
  return is_campaign_file(path) || has_log(path) ||
         (path.filename() == campaign_file_name && std::filesystem::exists(path, unseen));
}

/// Recognised by content, or by its name beside a campaign, where verify looks for one.
bool is_certificate(const std::filesystem::path& path) {
  if (path.filename() == certificate_file_name &&
      is_campaign(path.parent_path() / campaign_file_name))
    return true;
  const auto text = read_text_file(path, most_list_bytes);
  return text && certificate_from_json(*text);
}

}  // namespace

std::vector<Warning> warnings_of(const Dataset& dataset, const std::string& exploration) {
  if (holds_imprints(dataset)) return find_similar_labels(dataset.trials);
  const bool is_sum = exploration.find('+') != std::string::npos;
  return find_data_warnings(dataset, is_sum ? std::string_view() : std::string_view(exploration));
}

namespace {

/// Refuses other files that hold recordings, with what to do.
Status require_dataset(const std::filesystem::path& path) {
  if (is_campaign_file(path))
    return fail({.code = Errc::unsupported,
                 .where = path.string(),
                 .what = "file is a campaign file, not a data set",
                 .expected = "HDF5",
                 .got = "SQLite",
                 .hint = "Export it with `weft dataset export`"});
  if (is_recordings_file(path))
    return fail(
        {.code = Errc::unsupported,
         .where = path.string(),
         .what = "file has vibration recordings, not strokes of a tactile array",
         .hint = "Use it with weft vibro train, evaluate and classify, or weft trade vibro"});
  return {};
}

}  // namespace

Result<Dataset> open_dataset(const std::filesystem::path& path) {
  if (Status ok = require_dataset(path); !ok) return pass(ok.error());
  return read_hdf5(path);
}

Result<CampaignContents> open_campaign(const std::filesystem::path& path, CampaignLog log) {
  if (log == CampaignLog::whole)
    if (Status whole = check_wal(path); !whole) return pass(whole.error(), path.string());
  const Result<CampaignProgress> progress = load_progress(path);
  if (!progress) return pass(progress.error());
  Result<Dataset> all = load_campaign(path, {.all_outcomes = true});
  if (!all) return pass(all.error());
  CampaignContents out{{}, *progress, {}, 0};
  out.dataset.info = std::move(all->info);
  std::set<std::uint32_t> begun;
  for (std::size_t i = 0; i < all->trials.size(); ++i) {
    TrialRecord& record = all->records[i];
    begun.insert(record.spec.index);
    if (record.outcome != TrialOutcome::complete) {
      ++out.left_out[std::string(to_string(record.outcome))];
      continue;
    }
    out.dataset.trials.push_back(std::move(all->trials[i]));
    out.dataset.records.push_back(std::move(record));
  }
  out.never_begun = progress->planned - std::min<std::size_t>(begun.size(), progress->planned);
  return out;
}

Status refuse_same_file(const std::filesystem::path& input, const std::filesystem::path& output) {
  std::error_code not_there;
  if (!std::filesystem::equivalent(input, output, not_there)) return {};
  return fail({.code = Errc::invalid_argument,
               .where = output.string(),
               .what = "output is the same file as the input",
               .hint = "Choose another name"});
}

Status check_output(const std::filesystem::path& output) {
  if (auto ok = check_target(output); !ok) return ok;
  const char* const record = is_campaign(output)      ? "the recording of a campaign"
                             : is_certificate(output) ? "the certificate of a campaign"
                                                      : nullptr;
  if (record == nullptr) return {};
  return fail({.code = Errc::invalid_argument,
               .where = output.string(),
               .what = std::string("output would replace ") + record,
               .hint = "Choose another name"});
}

Status check_output(const std::filesystem::path& input, const std::filesystem::path& output) {
  if (auto ok = refuse_same_file(input, output); !ok) return ok;
  return check_output(output);
}

namespace {

// Works for files that do not exist yet, under any name.
bool will_be_one(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto canonical = [](const std::filesystem::path& path) {
    std::error_code unseen;
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path), unseen);
  };
  return canonical(a) == canonical(b);
}

}  // namespace

Status check_outputs(std::span<const std::filesystem::path> inputs,
                     std::span<const Output> outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const Output& own = outputs[i];
    if (own.file.empty()) continue;
    for (const std::filesystem::path& input : inputs)
      if (auto ok = refuse_same_file(input, own.file); !ok) return ok;
    for (const Output& before : outputs.first(i))
      if (!before.file.empty() && will_be_one(before.file, own.file))
        return fail({.code = Errc::invalid_argument,
                     .where = "--" + own.name,
                     .what = before.name + " and " + own.name + " are the same file",
                     .got = own.file.string(),
                     .hint = "Choose another name"});
    if (auto ok = check_output(own.file); !ok) return ok;
  }
  return {};
}

Result<RecordingSet> open_all_recordings(const std::filesystem::path& path) {
  if (is_recordings_file(path)) return read_recordings(path);
  if (Status ok = require_dataset(path); !ok) return pass(ok.error());
  auto dataset = DatasetReader::open(path);
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
                 .what = "explorations of recordings cannot be combined",
                 .expected = "one name",
                 .got = exploration});
  if (is_recordings_file(path)) {
    if (exploration.empty()) return read_recordings(path);
    return fail({.code = Errc::invalid_argument,
                 .where = path.string() + ": --exploration",
                 .what = "file of recordings has no explorations",
                 .expected = "a campaign",
                 .got = exploration});
  }
  if (Status ok = require_dataset(path); !ok) return pass(ok.error());
  auto dataset = DatasetReader::open(path);
  if (!dataset) return pass(dataset.error());
  const auto chosen = find_exploration(dataset->listed(), exploration, one_exploration);
  if (!chosen) return pass(chosen.error(), path.string());
  auto out = extract_recordings(*dataset, *chosen);
  if (!out) return pass(out.error(), path.string());
  return out;
}

namespace {

/// Name of trials from a pipe, in place of a file name.
constexpr const char* standard_input_name = "standard input";
constexpr std::string_view hdf5_signature = "\x89HDF\r\n\x1a\n";
constexpr std::size_t most_bytes = std::size_t{4} << 30;

Result<std::string> read_to_end(std::istream& in) {
  std::string text;
  std::array<char, 1 << 16> block{};
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > most_bytes)
      return fail({.code = Errc::range,
                   .what = "standard input too large",
                   .expected = "at most 4 GiB",
                   .hint = "Give the name of a file instead"});
  }
  if (text.empty())
    return fail({.code = Errc::not_found,
                 .what = "standard input is empty",
                 .expected = "a trial (CSV) or a data set"});
  return text;
}

// Removes the file in its destructor.
class TemporaryFile {
 public:
  TemporaryFile()
      : path_((std::filesystem::temp_directory_path() / "weft-stdin-XXXXXX").string()),
        handle_(::mkstemp(path_.data())) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (handle_ < 0) return;
    ::close(handle_);
    std::error_code gone;
    std::filesystem::remove(path_, gone);
  }
  [[nodiscard]] bool write(const std::string& bytes) const {
    return handle_ >= 0 && (std::ofstream(path_, std::ios::binary) << bytes).flush().good();
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
  int handle_;
};

Result<Dataset> read_dataset(const std::string& bytes) {
  const TemporaryFile file;
  if (!file.write(bytes))
    return fail({.code = Errc::io,
                 .where = file.path(),
                 .what = "data set from standard input not stored",
                 .hint = "Free space in the folder for temporary files, or set TMPDIR"});
  auto dataset = read_hdf5(file.path());
  if (!dataset) return pass(dataset.error(), standard_input_name);
  return dataset;
}

}  // namespace

Result<Dataset> trials_from(std::istream* in) {
  if (in == nullptr) return fail({.code = Errc::unsupported, .what = "no standard input"});
  auto text = read_to_end(*in);
  if (!text) return pass(text.error());
  if (text->starts_with(hdf5_signature)) return read_dataset(*text);
  return import_trial_text(standard_input_name, std::move(*text));
}

}  // namespace weft::daemon::cli

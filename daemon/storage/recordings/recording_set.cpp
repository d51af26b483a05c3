#include "daemon/storage/recordings/recording_set.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <span>

#include "daemon/base/file/sha256.hpp"

namespace weft::daemon {
namespace {

using classifier::vibro::Channel;
using classifier::vibro::Recording;

Status check_channels(const std::vector<Channel>& channels) {
  std::set<std::string> names;
  for (const Channel& c : channels) {
    if (c.name.empty() || !names.insert(c.name).second)
      return fail({.where = c.name, .what = "channel name missing or repeated"});
    if (!(c.rate_hz > 0.0) || !std::isfinite(c.rate_hz))
      return fail({.where = c.name,
                   .what = "sampling rate of a channel out of range",
                   .expected = "above 0 Hz",
                   .got = std::to_string(c.rate_hz) + " Hz"});
  }
  if (channels.empty()) return fail({.what = "recordings without channels"});
  return {};
}

Status check_recording(const Recording& recording, const std::vector<Channel>& channels) {
  if (recording.label.empty()) return fail({.what = "recording without label"});
  if (recording.channels != channels || recording.samples.size() != channels.size())
    return fail({.what = "channels differ from the first recording",
                 .expected = format_channels(channels),
                 .got = format_channels(recording.channels)});
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto& samples = recording.samples[c];
    if (samples.empty())
      return fail({.where = channels[c].name, .what = "channel without samples"});
    const auto odd = std::ranges::find_if(samples, [](double v) { return !std::isfinite(v); });
    if (odd != samples.end())
      return fail({.where = channels[c].name + ": sample " + std::to_string(odd - samples.begin()),
                   .what = "sample not a finite number"});
  }
  double end_s = 0.0;
  for (const classifier::vibro::Gap& gap : recording.gaps) {
    if (!(gap.from_s >= end_s && gap.to_s >= gap.from_s && std::isfinite(gap.to_s)))
      return fail({.where = "gap at " + std::to_string(gap.from_s) + " s",
                   .what = "gaps overlap or are out of order"});
    end_s = gap.to_s;
  }
  return {};
}

struct Span {
  std::int64_t from_ns = 0, to_ns = 0;
};

// The span of phase M on the host clock; nothing without a phase M.
std::optional<Span> find_motion(const classifier::Trial& trial, const TrialRecord& record) {
  std::optional<Span> out;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] != Phase::motion) continue;
    if (!out) out = Span{record.t_ns[i], record.t_ns[i]};
    out->to_ns = record.t_ns[i];
  }
  return out;
}

/// Spans of other phases within the motion [s after `begin_ns`].
std::vector<classifier::vibro::Gap> find_gaps(const classifier::Trial& trial,
                                              const TrialRecord& record, std::int64_t begin_ns) {
  std::vector<classifier::vibro::Gap> out;
  std::optional<std::size_t> last;  // sample in phase M
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] != Phase::motion) continue;
    if (last && *last + 1 < i)
      out.push_back({1e-9 * static_cast<double>(record.t_ns[*last] - begin_ns),
                     1e-9 * static_cast<double>(record.t_ns[i] - begin_ns)});
    last = i;
  }
  std::erase_if(out, [](const auto& gap) { return gap.to_s <= 0.0; });
  for (auto& gap : out) gap.from_s = std::max(gap.from_s, 0.0);
  return out;
}

tl::unexpected<Error> lost_blocks(std::int64_t at_ns) {
  return fail(
      {.what = "blocks lost in phase M",
       .expected = "every block of phase M",
       .got = "no block at " + std::to_string(at_ns / 1'000'000) + " ms of the host clock"});
}

// Samples of the blocks that lie wholly in M, one array per axis. Returns the start of the first
// block.
Result<std::int64_t> read_blocks(const BlockStream& stream, const BlockFormat& format,
                                 std::size_t axes, double per_unit, Span motion,
                                 std::vector<std::vector<double>>& out) {
  const std::size_t first_channel = out.size();
  out.resize(first_channel + axes);
  const auto block_ns =
      static_cast<std::int64_t>(1e9 * static_cast<double>(format.readings) / format.rate_hz);
  // Blocks are stamped on arrival, so a stamp may be late by up to half a block.
  const std::int64_t tolerance_ns = block_ns / 2;
  bool begun = false;
  std::int64_t begin_ns = 0, end_ns = 0;
  for (std::size_t b = 0; b < stream.blocks(); ++b) {
    if (stream.t_ns[b] - block_ns < motion.from_ns || stream.t_ns[b] > motion.to_ns) continue;
    if (!begun) begin_ns = stream.t_ns[b] - block_ns;
    if (begun && stream.lost[b] > 0) return lost_blocks(end_ns);
    begun = true;
    end_ns = stream.t_ns[b];
    for (std::size_t r = 0; r < format.readings; ++r)
      for (std::size_t a = 0; a < axes; ++a)
        out[first_channel + a].push_back(stream.quanta[(b * format.readings + r) * axes + a] /
                                         per_unit);
  }
  if (!begun) return fail({.what = "no complete block in phase M"});
  if (begin_ns - motion.from_ns >= block_ns + tolerance_ns) return lost_blocks(motion.from_ns);
  if (motion.to_ns - end_ns >= block_ns + tolerance_ns) return lost_blocks(end_ns);
  return begin_ns;
}

// Blocks of different streams have different lengths: all channels are cut to the latest start,
// which is returned.
std::int64_t align(const std::vector<std::int64_t>& begin_ns, const std::vector<Channel>& channels,
                   std::vector<std::vector<double>>& samples) {
  const std::int64_t common_ns = std::ranges::max(begin_ns);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const double early = 1e-9 * static_cast<double>(common_ns - begin_ns[c]) * channels[c].rate_hz;
    const auto cut = std::min(static_cast<std::size_t>(std::llround(early)), samples[c].size());
    samples[c].erase(samples[c].begin(), samples[c].begin() + static_cast<std::ptrdiff_t>(cut));
  }
  return common_ns;
}

}  // namespace

Status check(const RecordingSet& set) {
  if (set.recordings.empty()) return fail({.what = "data set without recordings"});
  const auto& channels = set.recordings.front().channels;
  if (auto fine = check_channels(channels); !fine) return fine;
  if (auto fine = check_group_names(set.group_columns); !fine) return fine;
  std::set<std::string_view> files;
  for (const Recording& r : set.recordings) {
    if (r.file.empty() || !files.insert(r.file).second)
      return fail({.where = r.file, .what = "recording name missing or repeated"});
    if (auto fine = check_recording(r, channels); !fine) return pass(fine.error(), r.file);
    if (auto fine = check_group_values(r.group_values, set.group_columns.size()); !fine)
      return pass(fine.error(), r.file);
  }
  return {};
}

std::vector<GroupColumn> list_group_columns(const RecordingSet& set) {
  auto out = transposed_columns(
      set.group_columns, set.recordings.size(), [&](std::size_t r) -> auto& {
        return set.recordings[r].group_values;
      });
  out.insert(out.end(), set.columns_of_trials.begin(), set.columns_of_trials.end());
  return out;
}

Result<std::vector<std::string>> group_labels(const RecordingSet& set, std::string_view column) {
  std::vector<std::string> groups, files;
  for (const Recording& r : set.recordings) groups.push_back(r.group), files.push_back(r.file);
  return find_group_labels(list_group_columns(set), column, std::move(groups), files);
}

std::string recordings_sha256(const RecordingSet& set) {
  Sha256 hash;
  hash.sized_text("weft-recordings 1");
  hash.sized_text(to_string(set.kind));
  for (const Recording& r : set.recordings) {
    for (const std::string* text : {&r.file, &r.label, &r.group}) hash.sized_text(*text);
    for (std::size_t c = 0; c < r.channels.size(); ++c) {
      hash.sized_text(r.channels[c].name);
      hash.sized_text(r.channels[c].unit);
      hash.number(r.channels[c].rate_hz);
      hash.number(static_cast<std::uint64_t>(r.samples[c].size()));
      hash.numbers(std::span<const double>(r.samples[c]));
    }
    for (const classifier::vibro::Gap& gap : r.gaps) {  // usually none
      hash.number(gap.from_s);
      hash.number(gap.to_s);
    }
  }
  if (!set.group_columns.empty()) hash.sized_text("weft group columns 1");
  for (const std::string& name : set.group_columns) hash.sized_text(name);
  for (const Recording& r : set.recordings)
    for (const std::string& value : r.group_values) hash.sized_text(value);
  return to_hex(hash.finish());
}

Copies copies_in(const RecordingSet& set) {
  std::vector<std::string> names, contents;
  for (const Recording& r : set.recordings) {
    Sha256 hash;
    for (const auto& samples : r.samples) {
      hash.number(static_cast<std::uint64_t>(samples.size()));
      hash.numbers(std::span<const double>(samples));
    }
    names.push_back(r.file);
    contents.push_back(to_hex(hash.finish()));
  }
  return copies_among(names, contents);
}

std::vector<Warning> find_data_warnings(const RecordingSet& set) {
  // The power of noise in one bin of a frame is about 1000 times its mean square; the floor,
  // librosa's amin, is 1e-10.
  constexpr double least_deviation = 1e-6;
  std::vector<CheckedSignal> signals;
  std::vector<std::string> names;
  for (const Channel& channel : set.recordings.front().channels)
    signals.push_back({.name = channel.name, .states = {}, .least_deviation = least_deviation});
  for (const Recording& r : set.recordings) {
    names.push_back(r.file);
    for (std::size_t c = 0; c < signals.size(); ++c)
      signals[c].states.push_back(classifier::check_signal(r.samples[c]));
  }
  std::vector<Warning> out = describe_signals(signals, names, "channel", "recording");
  for (Warning& one : find_similar_labels(set.recordings)) out.push_back(std::move(one));
  return out;
}

namespace {

/// Collects the recordings of trials, one after the other.
class RecordingCollector {
 public:
  /// `listed`: the data set, with or without samples. Errors: not_found without such streams.
  static Result<RecordingCollector> create(const Dataset& listed,
                                           std::optional<std::string_view> exploration) {
    RecordingCollector out;
    out.listed_ = &listed;
    out.exploration_ = exploration;
    const DatasetInfo& info = listed.info;
    if (info.sound.readings > 0) out.channels_.push_back({"S", info.sound.rate_hz, "Pa"});
    if (info.acceleration.readings > 0)
      for (const char* axis : {"X", "Y", "Z"})
        out.channels_.push_back({axis, info.acceleration.rate_hz, "m/s2"});
    if (out.channels_.empty())
      return fail({.code = Errc::not_found,
                   .what = "data set has neither sound nor acceleration",
                   .hint = "Record with a rig that has a device of role vibro"});
    out.set_ = {info.name, "campaign", info.kind, {}};
    out.columns_ = list_group_columns(listed);
    for (const GroupColumn& column : out.columns_)
      out.set_.columns_of_trials.push_back({column.name, {}});
    return out;
  }

  /// Whether trial i belongs to the set.
  [[nodiscard]] bool takes(std::size_t i) const {
    const TrialRecord& record = listed_->records[i];
    return record.outcome == TrialOutcome::complete &&
           (!exploration_ || record.spec.exploration == *exploration_);
  }

  /// Trial i, with its samples.
  Status add(std::size_t i, const classifier::Trial& trial, const TrialRecord& record) {
    const DatasetInfo& info = listed_->info;
    Recording own{trial.file, trial.label, std::to_string(record.spec.repetition), channels_, {}};
    const auto motion = find_motion(trial, record);
    if (!motion) return fail({.where = trial.file, .what = "trial without phase M"});
    std::vector<std::int64_t> begin_ns;  // per channel
    const auto read = [&](const BlockStream& stream, const BlockFormat& format, std::size_t axes,
                          double per_unit) -> Status {
      if (format.readings == 0) return {};
      const auto begin = read_blocks(stream, format, axes, per_unit, *motion, own.samples);
      if (!begin) return pass(begin.error(), trial.file);
      begin_ns.resize(begin_ns.size() + axes, *begin);
      return {};
    };
    Status done = read(record.sound, info.sound, 1, sound_quanta_per_pa);
    if (done)
      done = read(record.acceleration, info.acceleration, acceleration_axes,
                  acceleration_quanta_per_mps2);
    if (!done) return done;
    own.gaps = find_gaps(trial, record, align(begin_ns, channels_, own.samples));
    set_.recordings.push_back(std::move(own));
    for (std::size_t c = 0; c < columns_.size(); ++c)
      set_.columns_of_trials[c].of_row.push_back(columns_[c].of_row[i]);
    return {};
  }

  Result<RecordingSet> finish() {
    if (auto fine = check(set_); !fine) return pass(fine.error());
    return std::move(set_);
  }

 private:
  const Dataset* listed_ = nullptr;
  std::optional<std::string_view> exploration_;
  std::vector<Channel> channels_;
  std::vector<GroupColumn> columns_;
  RecordingSet set_;
};

}  // namespace

Result<RecordingSet> extract_recordings(const Dataset& dataset,
                                        std::optional<std::string_view> exploration) {
  auto out = RecordingCollector::create(dataset, exploration);
  if (!out) return pass(out.error());
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    if (out->takes(i))
      if (Status done = out->add(i, dataset.trials[i], dataset.records[i]); !done)
        return pass(done.error());
  return out->finish();
}

Result<RecordingSet> extract_recordings(DatasetReader& file,
                                        std::optional<std::string_view> exploration) {
  auto out = RecordingCollector::create(file.listed(), exploration);
  if (!out) return pass(out.error());
  for (std::size_t i = 0; i < file.listed().trials.size(); ++i) {
    if (!out->takes(i)) continue;
    const auto one = file.load(i);
    if (!one) return pass(one.error());
    if (Status done = out->add(i, one->trial, one->record); !done) return pass(done.error());
  }
  if (Status same = file.check_digest(); !same) return pass(same.error());
  return out->finish();
}

}  // namespace weft::daemon
